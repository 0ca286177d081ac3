// What the server of the explorer answers, as types; the modules of sweep.explorer have
// the same in words.

import type { Explorer } from "./show.js";

/** A number; null for one that is not there. */
export type Known = number | null;

export interface Study {
  study: string;
  model: string;
  preset: string;
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
}

export interface FigureAxis {
  name: string;
  label: string;
  logarithmic: boolean;
  names: string[];
}

export interface Panel {
  title: string;
  x: FigureAxis;
  y: FigureAxis;
  edges: [number[], number[]];
  marks: { columns: string[]; index: number[]; data: (Known | string | boolean)[][] };
}

export type Form = "lines" | "points" | "cells";

export interface Figure {
  kind: string;
  kinds: Record<string, { text: string; why_not: string }>;
  takes: string[];
  settings: string[];
  form: Form;
  metrics: string[];
  panels: Panel[];
  by: string;
  values: string[];
  colours: string[];
  note: string;
  thinned: string;
  command: string;
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
  column: number;
  row: number;
  half: Known;
  points: Known;
  resolved: boolean;
  best: boolean;
  point: string;
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
  sort: string;
  point: string;
  trial: string;
  region: string;
  parts: string;
  replicates: string;
}

/** uPlot 1.6.32, as far as it is used here. */
export interface Plotted {
  readonly root: HTMLElement;
  readonly over: HTMLElement;
  readonly data: (number | null)[][];
  setSize(size: { width: number; height: number }): void;
  valToPos(value: number, scale: string): number;
  posToVal(pixel: number, scale: string): number;
  destroy(): void;
}

declare global {
  interface Window {
    explorer: Explorer;
  }
  const uPlot: new (
    options: Record<string, unknown>,
    data: (number | null)[][],
    target: HTMLElement,
  ) => Plotted;
}
