// The view in a notebook, by the interface of anywidget: messages go through the comm of the kernel.

const WIDGET_HEIGHT = "860px";

// JupyterLab's theme is its own, whatever the system prefers.
function useTheme({ root, stage }) {
  const { jpThemeLight } = document.body.dataset;
  if (!jpThemeLight) return;
  root.style.colorScheme = jpThemeLight === "true" ? "light" : "dark";
  stage.readColours();
}

function render({ model, el }) {
  const receive = (message, buffers) => transport.onmessage(buffers.length ? buffers[0] : message);
  const transport = {
    start() {
      model.on("msg:custom", receive);
      transport.onopen();
    },
    send: (message) => model.send(message),
    close: () => model.off("msg:custom", receive),
  };
  const room = document.createElement("div"); // the style of `el` itself belongs to the notebook
  room.style.height = WIDGET_HEIGHT;
  el.append(room);
  let mounted = null;
  let request = 0;
  const begin = () => {
    // Without a document there are no styles, and no colours to draw with.
    if (!room.isConnected) {
      request = requestAnimationFrame(begin);
      return;
    }
    mounted = mount(room, transport);
    useTheme(mounted.view);
  };
  begin();
  return () => {
    cancelAnimationFrame(request);
    if (mounted) {
      transport.send({ type: "pause" });
      mounted.unmount();
    }
    room.remove();
  };
}

export default { render };
