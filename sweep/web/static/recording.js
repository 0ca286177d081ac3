// A recorded run as a transport: it answers the page as a server would, from what
// stands in the file.

const LOOK = 16; // ms between two looks at the clock

// `recording` has the messages controls, state and scene, the steps of its frames and
// the metrics in them, the spec, and the frames: as many bytes each, one after the
// other, in base64.
export function recorded(recording) {
  const { steps, metrics, state } = recording;
  const bytes = Uint8Array.from(
    atob(recording.frames),
    (letter) => letter.charCodeAt(0),
  );
  const size = bytes.length / steps.length;
  const last = steps.length - 1;
  let place = 0; // among the frames
  let sent = -1;
  let ready = true;
  let clock = 0; // steps, a fraction of one included
  let seen = 0;
  let answered = null; // the id of the last message

  const say = (message) => setTimeout(() => transport.onmessage?.(message));
  const sayState = () => say({ ...state, step: steps[place], answers: answered });
  const frame = () => {
    if (!ready || sent === place) return;
    ready = false;
    sent = place;
    say(bytes.buffer.slice(place * size, (place + 1) * size));
  };
  const go = (to) => {
    place = Math.min(Math.max(to, 0), last);
    clock = steps[place];
    frame();
  };
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
  const plotted = (names) => {
    const known = names.filter((name) => name in metrics);
    const values = Object.fromEntries(known.map((name) => [name, metrics[name]]));
    say({ type: "metrics", steps, values, reset: true });
  };

  const answers = {
    hello() {
      say(recording.controls);
      say(recording.scene);
      sayState();
      plotted(state.plots);
      sent = -1;
      ready = true;
      frame();
    },
    ready() {
      ready = true;
      frame();
    },
    run() {
      if (place === last) go(0);
      [state.running, seen, clock] = [true, performance.now(), steps[place]];
    },
    pause() {
      state.running = false;
    },
    step(message) {
      state.running = false;
      go(place + (message.count ?? 1));
    },
    reset: () => go(0),
    seek: (message) => go(at(message.frame)),
    speed(message) {
      state.speed = message.steps_per_second;
    },
    metrics(message) {
      state.plots = message.names.filter((name) => name in metrics);
      plotted(state.plots);
    },
    spec: () => say({ type: "spec", yaml: recording.spec, exact: true, note: "" }),
  };
  const timer = setInterval(look, LOOK);
  const transport = {
    onmessage: null,
    send(message) {
      const answer = answers[message.type];
      if (answer) answer(message);
      else {say({
          type: "error",
          message: "this is a recording: it can be played, and nothing in it changed",
        });}
      if (!message.id) return;
      answered = message.id;
      sayState();
    },
    close: () => clearInterval(timer),
  };
  return transport;
}
