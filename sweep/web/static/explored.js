// The explorer in a notebook, by the interface of anywidget: its page in a frame, and
// what the page says goes through the comm of the kernel.

/** @import { Bytes } from "./protocol.d.ts" */
/** @import { Channel, ExploredModel, Said } from "./kernel.d.ts" */

const HEIGHT = "900px";
/** @type {Record<string, string>} */
const SCHEMES = { true: "light", false: "dark" }; // by data-jp-theme-light

/** @param {{ model: ExploredModel, el: HTMLElement }} widget */
function render({ model, el }) {
  /** @type {Channel} */
  const channel = {
    hash: model.get("begin"),
    scheme: "",
    send: (message) => model.send(message),
    onmessage: () => {},
    onend: () => {},
  };
  /** @param {Said} said @param {Bytes[]} buffers */
  const receive = (said, buffers) =>
    channel.onmessage(said.type === "frame" ? { ...said, frame: buffers[0] } : said);
  const lose = () => {
    channel.send = () => {};
    channel.onend();
  };
  model.on("msg:custom", receive);
  model.on("comm_live_update", lose); // JupyterLab says this of a kernel begun anew
  const frame = document.createElement("iframe");
  frame.title = "Results of boidsweep";
  frame.style.cssText = `display: block; width: 100%; height: ${HEIGHT}; border: 0`;
  frame.allow = "clipboard-write; fullscreen";
  Object.assign(frame, { boidsweep: channel });
  // The page in the frame wears the theme of JupyterLab, whatever the system prefers.
  // Its canvases are drawn in colours, so it is loaded anew for another one.
  const follow = () => {
    const scheme = SCHEMES[document.body.dataset.jpThemeLight ?? ""] ?? "";
    if (scheme === channel.scheme) return;
    channel.scheme = scheme;
    frame.srcdoc = model.get("page");
  };
  const observer = new MutationObserver(follow);
  observer.observe(document.body, { attributeFilter: ["data-jp-theme-light"] });
  frame.srcdoc = model.get("page");
  follow();
  el.append(frame);
  return () => {
    observer.disconnect();
    model.off("msg:custom", receive);
    model.off("comm_live_update", lose);
    frame.remove();
  };
}

export default { render };
