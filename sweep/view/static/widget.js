// The view in a notebook, by the interface of anywidget: messages go through the comm of the kernel.

const WIDGET_HEIGHT = "720px";

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
  el.style.height = WIDGET_HEIGHT;
  const view = mount(el, transport);
  return () => {
    transport.send({ type: "pause" });
    view.unmount();
  };
}

export default { render };
