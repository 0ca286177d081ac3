// What the page and the session behind it say to each other, as types. The module
// sweep.web.protocol has the same conversation in words, and sends and reads it.

import type { View } from "./view.js";

/** A setting; an infinite number is the text "inf". */
export type Value = number | string | boolean;

/** Of a scene; `round` is 1 for a disc, whose halves are its radius. */
export type Obstacle = [
  x: number,
  y: number,
  halfWidth: number,
  halfHeight: number,
  round: number,
];

export type Kind = "disc" | "rectangle";

/** An obstacle as a spec writes it. */
export type Shape =
  | { disc: { x: number; y: number; radius: number } }
  | { rectangle: { x: number; y: number; width: number; height: number } };

/** From the page, with an `id` that its answer repeats. */
export type Message =
  & { id?: string }
  & (
    | { type: "hello"; page: string }
    | { type: "set"; name: string; value: Value }
    | { type: "model"; model: string; preset: string }
    | { type: "run" | "pause" | "reset" | "continue" | "spec" | "ready" }
    | { type: "step"; count?: number }
    | { type: "speed"; steps_per_second: number }
    | { type: "shapes"; shapes: Shape[] }
    | { type: "goal"; x: number; y: number }
    | { type: "select"; boid: number | null }
    | { type: "overlays" | "metrics"; names: string[] }
    | { type: "sweep"; name: string; low: number; high: number; points: number }
    | { type: "sweep"; name: string; off: true }
    | { type: "export"; kind: string }
    | { type: "seek"; frame: number }
  );

/** To the page. */
export type Reply =
  | Controls
  | State
  | Scene
  | Metrics
  | Selection
  | { type: "rules"; names: string[] }
  | Spec
  | File
  | Refusal
  | { type: "info"; message: string };

export interface Controls {
  type: "controls";
  models: { name: string; source: string; presets: string[] }[];
  model: string;
  preset: string;
  groups: Group[];
  maps: { name: string; text: string; size: [number, number] | null }[];
  metrics: Metric[];
  overlays: string[];
}

export interface Group {
  name: string;
  fields: Setting[];
}

/** What a control needs; `default` is the preset's value, null where it has none. */
export interface Setting {
  name: string;
  kind: "float" | "int" | "bool" | "choice";
  text: string;
  unit: string;
  allowed: string;
  low: number | null;
  high: number | null;
  slider: [low: number, high: number, step: number] | null;
  logarithmic: boolean;
  /** Whose weight the setting is, or empty. */
  rule: string;
  choices: string[];
  default: Value | null;
}

export interface Metric {
  name: string;
  text: string;
  unit: string;
  published: Published[];
}

/** What a document says of a metric: of a whole run, or of the frame at a step. */
export interface Published {
  value: number;
  where: string;
  says: string;
  frame: number | null;
  settings: Record<string, Value>;
}

export interface State {
  type: "state";
  model: string;
  preset: string;
  settings: Record<string, Value>;
  changed: string[];
  shapes: Shape[] | null;
  seed: number;
  running: boolean;
  speed: number;
  step: number;
  steps: number;
  exact: boolean;
  note: string;
  sweeps: Record<string, Sweep>;
  selected: number | null;
  overlays: string[];
  plots: string[];
  replay: Replay | null;
  answers?: string;
}

export interface Sweep {
  low: number;
  high: number;
  points: number;
}

/** `metrics` are those that are stored; a run that was not stored has none. */
export interface Replay {
  study: string;
  trial: string;
  frames: [first: number, last: number, every: number];
  equal: boolean;
  words: string;
  metrics?: Record<string, { stored: number; replayed: number }>;
  recorded?: true;
}

export interface Scene {
  type: "scene";
  width: number;
  height: number;
  borders: string;
  length: string;
  time: string;
  downwards: boolean;
  obstacles: Obstacle[];
  goal: [x: number, y: number, radius: number] | null;
  /** The kinds of boids: the first boids are of the first kind. */
  kinds: [name: string, boids: number][];
}

export interface Metrics {
  type: "metrics";
  steps: number[];
  values: Record<string, (number | null)[]>;
  reset: boolean;
}

export type Selection = { type: "selection"; boid: null } | Seen;

/** A boid, where it is, and whom it sees. */
export interface Seen {
  type: "selection";
  boid: number;
  x: number;
  y: number;
  range: number | "inf";
  fov: number;
  heading: number | null;
  neighbours: number[];
}

export interface Spec {
  type: "spec";
  yaml: string;
  exact: boolean;
  note: string;
}

/** A file; `data` is its content in base64. */
export interface File {
  type: "file";
  name: string;
  mime: string;
  data: string;
}

export interface Refusal {
  type: "error";
  message: string;
  answers?: string;
}

export type Bytes = ArrayBuffer | DataView<ArrayBuffer>;

/** What a view hears: a message, or the bytes of a frame. */
export type Heard = Reply | Bytes;

/** What a transport tells its view, which sets these when it is mounted. */
export interface Listener {
  onmessage(heard: Heard): void;
  onopen(): void;
  /** For a while. */
  onclose(words: string): void;
  /** For good. */
  onend(words: string): void;
}

/** The way to a session. One without `start` is open from the beginning. */
export interface Transport extends Partial<Listener> {
  start?(): void;
  send(message: Message): void;
  close(): void;
}

/** What an export to disk has in it; `frames` are in base64, as many bytes each. */
export interface Recording {
  controls: Controls;
  state: State;
  scene: Scene;
  spec: string;
  steps: number[];
  metrics: Record<string, (number | null)[]>;
  about: Record<string, string>;
  frames: string;
}

/** The model of a widget as anywidget gives it, as far as it is used here. */
export interface Model {
  on(event: "msg:custom", act: (message: Reply, buffers: Bytes[]) => void): void;
  on(event: "comm_live_update", act: () => void): void;
  off(event: "msg:custom", act: (message: Reply, buffers: Bytes[]) => void): void;
  off(event: "comm_live_update", act: () => void): void;
  send(message: Message): void;
}

declare global {
  /** What the served page shows, for whoever looks at it from outside. */
  var boidsweep: { view: View; unmount(): void; socket: Transport };
}
