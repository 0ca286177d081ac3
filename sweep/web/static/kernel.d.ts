// What the explorer in a notebook and its kernel say to each other, as types: as the
// module sweep.explorer.widget has it in Python.

import type { Bytes, Reply } from "./protocol.d.ts";

/** Of a run that is played. */
export type Told =
  | { type: "told"; line: string; message: Reply; frame?: undefined }
  | { type: "frame"; line: string; message?: undefined; frame: Bytes }
  | { type: "over"; line: string; why: string };

export type Said =
  | { type: "heard"; id: string }
  | { type: "answer"; id: string; answer: unknown }
  | { type: "refusal"; id: string; why: string }
  | Told;

/** The way between the page in its frame and the widget about it, which outlives it. */
export interface Channel {
  /** What the page shows, as its address says it. */
  hash: string;
  /** light, dark, or "" for what the system prefers. */
  scheme: string;
  send(message: Record<string, unknown>): void;
  onmessage(said: Said): void;
  onend(): void;
}

export interface Line {
  receive(said: Told): void;
  onend(words: string): void;
}

/** The model of a widget, by the interface of anywidget. */
export interface ExploredModel {
  get(name: "page" | "begin"): string;
  send(message: Record<string, unknown>): void;
  on(event: string, act: (...about: never[]) => void): void;
  off(event: string, act: (...about: never[]) => void): void;
}
