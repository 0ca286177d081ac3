// What the page and the session behind it say to each other, as types. The module
// sweep.web.protocol has the same conversation in words, and sends and reads it.

import type { mount } from "./mount.js";

/** A setting; an infinite number is the text "inf". */
export type Value = number | string | boolean;

/** A polygon as a spec writes it; an arena is solid outside. */
export interface Polygon {
  vertices: [x: number, y: number][];
  solid?: "inside" | "outside";
}

/**
 * Of a scene; `round` is 1 for a disc, whose halves are its radius. The first numbers
 * of a polygon are the rectangle about it; those of an arena, the world.
 */
export type Obstacle = [
  x: number,
  y: number,
  halfWidth: number,
  halfHeight: number,
  round: number,
  polygon?: Polygon,
];

/** How obstacles move: velocities along x and along y, and the time of a step. */
export interface Paths {
  velocities: [x: number[], y: number[]];
  dt: number;
  wraps: boolean;
}

export type Kind = "disc" | "rectangle";

/** An obstacle as a spec writes it. */
export type Shape =
  | { disc: { x: number; y: number; radius: number } }
  | { rectangle: { x: number; y: number; width: number; height: number } }
  | { polygon: Polygon };

/** From the page, with an `id` that its answer repeats. */
export type Message =
  & { id?: string; side?: number }
  & (
    | { type: "hello"; page: string } & Partial<Kept> & Partial<StoredName>
    | { type: "set"; name: string; value: Value; part?: boolean }
    | { type: "model"; model: string; preset: string }
    | { type: "trial"; point: number; replicate: number }
    | { type: "value"; name: string; value: Value }
    | { type: "run" | "pause" | "reset" | "continue" | "spec" | "keep" | "ready" }
    | { type: "stop" | "origin" }
    | { type: "step"; count?: number }
    | { type: "speed"; steps_per_second: number }
    | { type: "shapes"; shapes: Shape[]; part?: boolean }
    | { type: "goal"; x: number; y: number; index?: number; part?: boolean }
    | { type: "select"; boid: number | null }
    | { type: "overlays" | "metrics"; names: string[] }
    | { type: "sweep"; name: string; low: number; high: number; points: number }
    | { type: "sweep"; name: string; off: true }
    | { type: "export"; kind: string }
    | { type: "seek"; frame: number }
    | { type: "undo" | "redo" | "alone" }
    | { type: "beside"; preset?: string }
  );

/** To the page; `side` is 1 in what is about the second of two runs. */
export type Reply =
  & { side?: number }
  & Said;

export type Said =
  | Controls
  | State
  | Scene
  | Metrics
  | Selection
  | { type: "rules"; names: string[] }
  | Spec
  | { type: "kept" } & Kept
  | File
  | OriginOf
  | Progress
  | Refusal
  | { type: "info"; message: string }
  | { type: "anew" };

export interface Controls {
  type: "controls";
  /** `texts` says what presets stand for. */
  models: {
    name: string;
    source: string;
    presets: string[];
    texts: Record<string, string>;
  }[];
  model: string;
  preset: string;
  /** The values in which each other preset of the model differs. */
  others: Record<string, Record<string, Value>>;
  groups: Group[];
  maps: { name: string; text: string; size: [number, number] | null }[];
  metrics: Metric[];
  overlays: string[];
  trials: Trials | null;
}

/** A stored trial: its study and its id; and another one of it to play beside it. */
export interface StoredName {
  study: string;
  trial: string;
  beside?: string;
}

/** What a page needs to go on when its session is gone; of two runs that of both. */
export interface Kept {
  yaml: string;
  /** The id of the point. */
  point: string;
  replicate: number;
  yaml_beside?: string;
  point_beside?: string;
  replicate_beside?: number;
  /** Of a stored trial that was played, its study and its id. */
  kept_study?: string;
  kept_trial?: string;
}

/** The trials of an opened spec. An axis of many values has none here. */
export interface Trials {
  study: string;
  points: number;
  replicates: number;
  axes: { name: string; values: Value[]; follows: string }[];
}

/** Which of them is shown. */
export interface Trial {
  point: number;
  replicate: number;
  values: Record<string, Value>;
  /** The trials beside it in the order of points and replicates; null where none is. */
  before: [point: number, replicate: number] | null;
  after: [point: number, replicate: number] | null;
}

export interface Group {
  name: string;
  fields: Setting[];
}

/** What a control needs; `default` is the preset's value, null where it has none. */
export interface Setting {
  name: string;
  kind: "float" | "int" | "bool" | "choice" | "places";
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
  /** The document that defines it. */
  source: string;
  published: Published[];
}

/**
 * What a document says of a metric: of a whole run, or of the frame at a step. A
 * setting for which no value stands is null.
 */
export interface Published {
  value: number;
  where: string;
  says: string;
  half: boolean;
  frame: number | null;
  settings: Record<string, Value | null>;
}

export interface State {
  type: "state";
  /** Another number for each run; frames that follow are of this one. */
  run: number;
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
  /** The steps that can be gone to. */
  past: [first: number, last: number];
  /** What would be undone, in words, or empty. */
  undo: string;
  redo: string;
  /** Of one of two runs: why it goes no further, or empty. */
  ended?: string;
  exact: boolean;
  note: string;
  sweeps: Record<string, Sweep>;
  /** What settings follow from, by their names. */
  follows: Record<string, string[]>;
  selected: number | null;
  overlays: string[];
  plots: string[];
  trial: Trial | null;
  /** The kinds that cannot be made, and why. */
  files: Record<string, string>;
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
  /** Of a stored one: the values of what varies, and the replicate. */
  which?: string;
  /** Of a stored trial, its number among those of its point. */
  replicate?: number;
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
  /** Null where none moves. */
  paths: Paths | null;
  goal: [x: number, y: number, radius: number] | null;
  /** Where boids go from the goal on, one after the other. */
  next_goals: [x: number, y: number][];
  /** The kinds of boids: the first boids are of the first kind. */
  kinds: [name: string, boids: number][];
  /** The boids that fail, and the step from which on each of them has; or null. */
  failing: { how: string; boids: [boid: number, from: number][] } | null;
}

export interface Metrics {
  type: "metrics";
  steps: number[];
  values: Record<string, (number | null)[]>;
  /** The steps at which a metric of visits restarts from 0. */
  restarts?: Record<string, number[]>;
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
  /** Where it knows these to be, if that is not where they are. */
  known?: [number, number][];
}

export interface Spec {
  type: "spec";
  yaml: string;
  /** Which trial of it is shown, or empty. */
  trial: string;
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

/** What a picture of the frame says of itself. No name has an ending. */
export interface OriginOf {
  type: "origin";
  name: string;
  trial: string;
  about: Record<string, string>;
}

/** Of the file that is being made; `kind` is null when there is none any more. */
export interface Progress {
  type: "progress";
  kind: string | null;
  doing: string;
  share: number;
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

/** What a page that plays from disk reads. */
export interface RecordedPage {
  front: FrontMatter;
  recording: Recording;
}

export interface FrontMatter {
  title: string;
  caption: string;
  /** A line a work. */
  cite: string[];
  licence: string;
}

/** A run on a page; `frames` are in base64, as many bytes each, at `steps`. */
export interface Recording {
  groups: Group[];
  metrics: Metric[];
  state: State;
  scene: Scene;
  senses: SensesOf;
  spec: string;
  steps: number[];
  values: Record<string, (number | null)[]>;
  about: Record<string, string>;
  /** In base64, or as the page has computed them. */
  frames: string | Uint8Array<ArrayBuffer>;
}

/**
 * What tells from places whom a boid sees. `resting` has in base64 a bit for each boid
 * of each frame: whether it sees all round, because it rests. With `measured` boids
 * know what they measured and heard, which is not recorded.
 */
export interface SensesOf {
  range: number | "inf";
  fov: number;
  inclusive: boolean;
  shortest_way: boolean;
  flock_range: number;
  resting: string;
  measured: boolean;
  pixels: Pixels | null;
}

/** Those that are visited, `per_length` of them a length, within `radius` pixels. */
export interface Pixels {
  rows: number;
  columns: number;
  per_length: number;
  radius: number;
  truncated: boolean;
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
  var boidsweep: ReturnType<typeof mount> & { socket: Transport };
}
