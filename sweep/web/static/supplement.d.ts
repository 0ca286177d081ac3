// What the page of a supplement reads, as types. The module sweep.explorer.supplement
// writes it.

import type { Packed, Scene, SensesOf } from "./protocol.d.ts";

/** An axis of numbers. */
export interface SupplementAxis {
  name: string;
  label: string;
  logarithmic: boolean;
  values: number[];
}

/** A row of `sweep table --json`. */
export type SupplementRow = Record<string, number | string | boolean | null>;

/** A mark of the figure; `runs` are the places of its runs, and `why` says why none. */
export interface SupplementPoint {
  words: string;
  colour: number;
  runs: number[];
  why: string;
  /** Of a heatmap: the edges of its cell, which lies over those of a lower order. */
  cell: {
    box: [left: number, right: number, bottom: number, top: number];
    order: number;
    resolved: boolean;
  } | null;
}

/** A stored trial that was run again; `values` are those of the metric. */
export interface SupplementRun {
  trial: string;
  roles: string[];
  value: number;
  replicate: number;
  scene: number;
  stored: number | null;
  notes: string[];
  every: number;
  steps: number[];
  values: (number | null)[];
  senses: SensesOf;
  frames: Uint8Array<ArrayBuffer>;
  /** Of a trial that the page computes: until then there are no frames. */
  start: ComputedStart | null;
  /** Whether the metrics that the page has computed are the stored ones. */
  same?: boolean;
  /** What differs from the stored trial, where a reader has changed it. */
  altered?: string;
}

/** Places of arrays among those of a kernel. */
export interface ComputedTables {
  marks: number;
  steps_of: number;
  values: number;
  numbers: number;
}

/** The WebAssembly of a kernel, compressed; `pages` is its least memory. */
export interface ComputedModule {
  code: string;
  pages: number;
  tables: ComputedTables;
  metrics: string[];
}

/** Contents of memory are compressed, and each is there once. */
export interface Computation {
  modules: ComputedModule[];
  contents: string[];
}

/** A trial before its first step: the memory and the numbers of its kernel. */
export interface ComputedStart {
  module: number;
  rooms: [size: number, item: number][];
  pieces: [room: number, first: number, content: number][];
  /** Integers and floats of the first call, of 64 bits each, in base64. */
  wholes: string;
  reals: string;
  bodies: [room: number, firsts: number[]];
  /** Metrics before the first step. */
  first: (number | null)[];
  /** The stored metrics of the last frame: floats of 64 bits, in base64. */
  last: string;
  faces: boolean;
  changes: ComputedChange[];
  n: number;
  steps: number;
}

/** A parameter that a reader may change; `row` is its place in the memory. */
export interface ComputedChange {
  name: string;
  text: string;
  unit: string;
  value: number;
  low: number;
  high: number;
  row: number;
}

/** A trial that the page has computed; `same` says that its metrics are the stored. */
export interface ComputedRun {
  steps: number[];
  values: (number | null)[];
  frames: Uint8Array<ArrayBuffer>;
  resting: string;
  same: boolean;
}

export interface SupplementFront {
  title: string;
  authors: string[];
  doi: string;
  caption: string;
  licence: string;
  cite: string[];
  run: string[];
  needs: string;
  origin: [name: string, words: string][];
}

export interface SupplementData {
  front: SupplementFront;
  study: string;
  spec: string;
  figure: {
    form: "lines" | "points" | "cells" | "rows";
    column: string;
    metric: { name: string; text: string; unit: string };
    label: string;
    /** The end of the part around 0 that is linear; 0 for a linear scale. */
    linear: number;
    says: string;
    note: string;
    x: SupplementAxis | null;
    y: SupplementAxis | null;
    by: { name: string; label: string; values: string[] } | null;
  };
  headings: string[];
  rows: SupplementRow[];
  points: SupplementPoint[];
  scenes: Scene[];
  /** Which trial of a point is shown first. */
  role: string;
  runs: SupplementRun[];
  computation: Computation;
}

/** The data in the text of the page. */
export type SupplementText =
  & Omit<SupplementData, "runs">
  & { runs: Packed<SupplementRun>[] };

declare global {
  /** What the page shows, for whoever looks at it from outside. */
  var supplement: { place: number };
}
