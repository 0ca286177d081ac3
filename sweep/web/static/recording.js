// A recorded run as a transport. It answers the page as a server does, from the data in
// the file.

import { bytesOf } from "./dialogs.js";
import { mount } from "./view.js";

/** @import { Heard, Message, Recording, Transport } from "./protocol.d.ts" */

const FIXED = "this is a recording: it can be played, and nothing in it changed";
const TICK = 16; // ms between two checks of the clock

// `recording` has the messages controls, state and scene, the steps of its frames and
// the metrics in them, the spec, and the frames: as many bytes each, one after the
// other, in base64.
/** @param {Recording} recording @returns {Transport} */
function recorded(recording) {
  const { steps, metrics, state } = recording;
  const bytes = bytesOf(recording.frames);
  const size = bytes.length / steps.length;
  const last = steps.length - 1;
  let place = 0; // index of the frame on the screen
  let sent = -1;
  let ready = true;
  let clock = 0; // steps, a fraction of one included
  let seen = 0;
  /** @type {string | undefined} */
  let answered; // the id of the last message

  /** @param {Heard} heard */
  const say = (heard) => {
    setTimeout(() => transport.onmessage?.(heard));
  };
  const sayState = () => say({ ...state, step: steps[place], answers: answered });
  const frame = () => {
    if (!ready || sent === place) return;
    ready = false;
    sent = place;
    say(bytes.buffer.slice(place * size, (place + 1) * size));
  };
  /** @param {number} to */
  const go = (to) => {
    place = Math.min(Math.max(to, 0), last);
    clock = steps[place];
    frame();
  };
  /** @param {number} step */
  const at = (step) => {
    let found = 0;
    while (found < last && steps[found + 1] <= step) found++;
    return found;
  };
  const look = () => {
    const now = performance.now();
    const passed = (now - seen) / 1000;
    seen = now;
    if (!state.running) return;
    if (state.speed > 0) {
      clock = Math.min(clock + passed * state.speed, steps[last]);
      place = at(clock);
    } else if (ready) place = Math.min(place + 1, last);
    frame();
    if (place < last) return;
    state.running = false;
    sayState();
  };
  /** @param {string[]} names */
  const plotted = (names) => {
    const known = names.filter((name) => name in metrics);
    const values = Object.fromEntries(known.map((name) => [name, metrics[name]]));
    say({ type: "metrics", steps, values, reset: true });
  };

  const greet = () => {
    say(recording.controls);
    say(recording.scene);
    sayState();
    plotted(state.plots);
    sent = -1;
    ready = true;
    frame();
  };
  const run = () => {
    if (place === last) go(0);
    [state.running, seen, clock] = [true, performance.now(), steps[place]];
  };
  /** @param {Message} message */
  const answer = (message) => {
    switch (message.type) {
      case "hello":
        return greet();
      case "ready":
        ready = true;
        return frame();
      case "run":
        return run();
      case "pause":
        state.running = false;
        return;
      case "step":
        state.running = false;
        return go(place + (message.count ?? 1));
      case "reset":
        return go(0);
      case "seek":
        return go(at(message.frame));
      case "speed":
        state.speed = message.steps_per_second;
        return;
      case "metrics":
        state.plots = message.names.filter((name) => name in metrics);
        return plotted(state.plots);
      case "spec":
        return say({ type: "spec", yaml: recording.spec, exact: true, note: "" });
      default:
        return say({ type: "error", message: FIXED });
    }
  };
  const timer = setInterval(look, TICK);
  /** @type {Transport} */
  const transport = {
    send(message) {
      answer(message);
      if (!message.id) return;
      answered = message.id;
      sayState();
    },
    close: () => clearInterval(timer),
  };
  return transport;
}

const main = document.querySelector("main");
const content = document.getElementById("recording")?.textContent;
if (main && content) {
  mount(main, recorded(JSON.parse(content)), { shortcuts: document });
}
