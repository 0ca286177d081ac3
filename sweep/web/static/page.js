// The served page: a socket to the server that started it, opened again whenever it was
// dropped.

import { randomName } from "./dom.js";
import { mount } from "./view.js";

const FIRST_WAIT = 300; // ms
const LONGEST_WAIT = 8000;
const OVER = {
  4001: "This run went on in another window.",
  4002: "The server has no run for this page.",
};

function pageId() {
  const known = sessionStorage.getItem("boidsweep-page") ?? randomName();
  sessionStorage.setItem("boidsweep-page", known);
  return known;
}

class Socket {
  constructor() {
    this.address = new URL("socket", location.href);
    this.address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    this.wait = FIRST_WAIT;
    this.closed = false;
  }

  start() {
    this.socket = new WebSocket(this.address);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => {
      this.wait = FIRST_WAIT;
      this.onopen();
    };
    this.socket.onmessage = ({ data }) =>
      this.onmessage(typeof data === "string" ? JSON.parse(data) : data);
    this.socket.onclose = (
      { code },
    ) => (OVER[code] ? this.onclose(OVER[code]) : this.again());
  }

  again() {
    if (this.closed) return;
    this.onclose(
      `The connection is lost. Trying again in ${
        Math.ceil(this.wait / 1000)
      } s; is sweep view still running?`,
    );
    setTimeout(() => this.start(), this.wait);
    this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
  }

  send(message) {
    if (this.socket.readyState === WebSocket.OPEN) {
      this.socket.send(JSON.stringify(message));
    }
  }

  close() {
    this.closed = true;
    this.socket.close();
  }
}

const socket = new Socket();
const mounted = mount(document.querySelector("main"), socket, {
  page: pageId(),
  shortcuts: document,
});
window.boidsweep = { ...mounted, socket };
