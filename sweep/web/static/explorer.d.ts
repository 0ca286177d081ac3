// What the server of the explorer answers, as types; the modules of sweep.explorer have
// the same in words.

import type { Explorer } from "./show.js";

/** A number; null for one that is not there. */
export type Known = number | null;

export interface Study {
  study: string;
  model: string;
  preset: string;
  varied: string | null;
  trials: Known;
  done: Known;
  not_done: Known;
  missing: Known;
  error: string;
}

export interface Cause {
  status: string;
  trials: number;
  cause: string;
  first: string;
}

/** 0 for done, 1 for not done, 2 for missing. */
export type Mark = 0 | 1 | 2;

export interface Strip {
  per: number;
  row: number;
  marks: Mark[];
}

export interface StudyState {
  revision: string;
  running: string[];
  study: string;
  about: Record<string, string>;
  points: number;
  trials: number;
  counts: Record<string, number>;
  missing: number;
  rate: Known;
  left: Known;
  strip: Strip;
  causes: Cause[];
  metrics: string[];
  series: string[];
  settings: string[];
  search: string;
}

export interface Points {
  headings: string[];
  metrics: string[];
  units: Record<string, string>;
  total: number;
  page: number;
  size: number;
  rows: Record<string, Known | string | boolean>[];
  points: string[];
  cells: string[][];
  caption: string;
  command: string;
}

export interface Trial {
  trial_id: string;
  point: string;
  replicate: number;
  status: string;
  error: string;
  value: Known;
  part: string;
  replay: string;
}

export interface Trials {
  metric: string;
  unit: string;
  total: number;
  page: number;
  size: number;
  rows: Trial[];
  settings: Record<string, Record<string, Known | string | boolean>>;
  /** The trial in the middle by the metric; "" for none. */
  median: string;
}

export interface FigureAxis {
  name: string;
  label: string;
  logarithmic: boolean;
  names: string[];
  /** The listed values at which ticks stand; none for ticks at round numbers. */
  listed: number[];
  low?: Known;
  high?: Known;
}

export interface Panel {
  title: string;
  x: FigureAxis;
  y: FigureAxis;
  /** Of cells: the left, right, lower and upper end of all panels. */
  span: number[];
  line: { x: number[]; y: number[]; text: string };
  marks: Marks;
  /** Values of single trials; null for a figure without them. */
  trials: Marks | null;
}

export interface Marks {
  columns: string[];
  data: (Known | string | boolean)[][];
}

export type Form = "lines" | "paths" | "points" | "cells";

export interface Figure {
  kind: string;
  kinds: Record<string, { text: string; why_not: string }>;
  /** Why the figure cannot be drawn, or "": then it has no panels. */
  refusal: string;
  takes: string[];
  /** Why single trials cannot be drawn, or "". */
  trials_why_not: string;
  settings: string[];
  form: Form;
  metrics: string[];
  panels: Panel[];
  by: string;
  values: string[];
  colours: string[];
  note: string;
  thinned: string;
  /** Endings of the files of the figure, and widths for journals in mm. */
  formats: string[];
  widths: string[];
  command: string;
}

/** A published number, which holds at the settings of a point. */
export interface Published {
  point: string;
  value: number;
  where: string;
  says: string;
}

/** One mark: what a row of a panel says. */
export interface Dot {
  x: Known;
  y: Known;
  low: Known;
  high: Known;
  x_low: Known;
  x_high: Known;
  n: Known;
  colour: number;
  /** Of a cell: its edges, and where its point lies on both axes. */
  left: number;
  right: number;
  bottom: number;
  top: number;
  across: Known;
  up: Known;
  half: Known;
  points: Known;
  resolved: boolean;
  best: boolean;
  point: string;
  /** Of the value of a single trial: its id and its replicate. */
  trial?: string;
  replicate?: number;
}

/** A table of texts, with the ids of the points behind each row. */
export interface Told {
  titles: string[];
  rows: string[][];
  note: string;
  points: string[];
}

export interface Searched {
  searched: string;
  notes: string[];
  best: string;
  tables: Told[];
  said: string[];
  command: string;
}

/** Trials that test a claim, in the words of the page. */
export interface Tested {
  study: string;
  metric: string;
  half: string;
  where: string;
}

export interface Claim {
  id: string;
  study: string;
  says: string;
  where: string;
  status: string;
  /** The sign of the status. */
  mark: string;
  reason: string;
  trials: number;
  published: string;
  ours: string;
  picture: boolean;
  behind: Tested[];
}

export interface Scorecard {
  revision: string;
  scale: string;
  scales: string[];
  documents: Record<string, string>;
  rows: Claim[];
  command: string;
}

/** A row of a comparison, as sweep compare --json has it, with its settings. */
export interface Difference {
  metric: string;
  unit: string;
  a: Known;
  b: Known;
  difference: Known;
  low: Known | string;
  high: Known | string;
  p: Known;
  paired: boolean;
  verdict: string;
  /** The parameters of the row, by name. */
  [setting: string]: Known | string | boolean;
}

/** Whose trials a row of a comparison rests on. */
export interface Behind {
  metric: string;
  a: string;
  b: string;
}

export interface Compared {
  revision: string;
  facts: {
    a: { selection: string; study: string };
    b: { selection: string; study: string };
    method: { confidence: number; together: string; margin: Known };
    rows: Difference[];
    summary: string[];
  };
  titles: string[];
  cells: string[][];
  behind: Behind[];
  settings: string[];
  total: number;
  page: number;
  size: number;
  heading: string[];
  notes: string[];
  metrics: string[];
  corrections: string[];
  command: string;
}

/** What a launch of a text would change; see sweep.web.launching. */
export interface Proposal {
  text: string;
  file: string;
  lines: string;
  difference: string;
  to_run: number;
  command: string;
  seen: string;
  why_not: string;
}

export interface Refined extends Proposal {
  between: Record<string, [number, number]>;
  replicates: Known;
}

/** The file that the page may launch, "" for none, and what it has launched. */
export interface Launches {
  file: string;
  started: { study: string; process: number; code: Known; said: string } | null;
}

/** What the page shows, as its address says it. */
export interface Choice {
  study: string;
  kind: string;
  metric: string;
  x: string;
  y: string;
  by: string;
  where: string;
  half: string;
  /** "yes" for a figure with the values of single trials. */
  trials: string;
  /** The width in mm of the files of the figure; "" for the width as drawn. */
  width: string;
  sort: string;
  point: string;
  trial: string;
  /** Another trial, which plays beside the first one. */
  beside: string;
  a: string;
  b: string;
  margin: string;
  confidence: string;
  together: string;
  ranked: string;
  side: string;
  scorecard: string;
  claim: string;
  /** The status of the claims that are listed; "" for all. */
  verdict: string;
  region: string;
  parts: string;
  replicates: string;
}

declare global {
  interface Window {
    explorer: Explorer;
  }
}
