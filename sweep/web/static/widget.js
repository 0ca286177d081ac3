// The view in a notebook, by the interface of anywidget: messages go through the comm
// of the kernel.

import { mount } from "./mount.js";

/** @import { Bytes, Model, Reply, Transport } from "./protocol.d.ts" */
/** @import { View } from "./view.js" */

const WIDGET_HEIGHT = "860px";
/** @type {Record<string, string>} */
const SCHEMES = { true: "light", false: "dark" }; // by data-jp-theme-light
const WAITED = 1500; // ms
const WAITING = "Waiting for the kernel, which is busy or gone.";
const GONE = "The kernel of this run has stopped. Run the cell again for a new run.";

// JupyterLab has a theme of its own, whatever the system prefers. It may change at any
// time. Returns a function that ends the following.
/** @param {View} view */
function followTheme({ root, stage }) {
  const follow = () => {
    const { jpThemeLight } = document.body.dataset;
    root.style.colorScheme = SCHEMES[jpThemeLight ?? ""] ?? "";
    stage.readColours();
  };
  const observer = new MutationObserver(follow);
  observer.observe(document.body, { attributeFilter: ["data-jp-theme-light"] });
  follow();
  return () => observer.disconnect();
}

// Keys belong to the view: in a notebook D twice deletes a cell. It may still be saved.
/** @param {KeyboardEvent} event */
function keep(event) {
  const saving = (event.ctrlKey || event.metaKey) && event.key === "s";
  if (!saving) event.stopPropagation();
}

/** @param {{ model: Model, el: HTMLElement }} widget */
function render({ model, el }) {
  /** @type {ReturnType<typeof mount> | null} */
  let mounted = null;
  let request = 0;
  let waiting = 0;
  let unfollow = () => {};
  /** @param {Reply} message @param {Bytes[]} buffers */
  const receive = (message, buffers) => {
    clearTimeout(waiting);
    transport.onmessage?.(buffers.length ? buffers[0] : message);
  };
  const lose = () => {
    clearTimeout(waiting);
    transport.send = () => {};
    transport.onend?.(GONE);
  };
  /** @type {Transport} */
  const transport = {
    start() {
      model.on("msg:custom", receive);
      // JupyterLab says this when its kernel has begun anew.
      model.on("comm_live_update", lose);
      waiting = setTimeout(() => transport.onclose?.(WAITING), WAITED);
      transport.onopen?.();
    },
    send(message) {
      try {
        model.send(message);
      } catch {
        lose();
      }
    },
    close() {
      clearTimeout(waiting);
      model.off("msg:custom", receive);
      model.off("comm_live_update", lose);
    },
  };
  // The style of `el` itself belongs to the notebook.
  const room = document.createElement("div");
  room.style.height = WIDGET_HEIGHT;
  room.addEventListener("keydown", keep);
  el.append(room);
  const begin = () => {
    // Without a document there are no styles, and no colours to draw with.
    if (!room.isConnected) {
      request = requestAnimationFrame(begin);
      return;
    }
    mounted = mount(room, transport);
    unfollow = followTheme(mounted.view);
  };
  begin();
  return () => {
    cancelAnimationFrame(request);
    unfollow();
    if (mounted) {
      transport.send({ type: "pause" });
      mounted.unmount();
    }
    room.remove();
  };
}

export default { render };
