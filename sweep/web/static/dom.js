// Elements, icons and numbers: what all parts of the page are made of. Text is set as
// text, never as HTML.

const PICTURES = {
  play: ["M7 4.5v15l12.5-7.5z", true],
  pause: ["M6.5 5h4v14h-4zM13.5 5h4v14h-4z", true],
  step: ["M5 4.5v15l10-7.5zM17 5h2.5v14H17z", true],
  reset: ["M4.5 13a7.5 7.5 0 1 0 2-6L4 9.5M4 4.5v5h5"],
  forward: ["M4 5v14l8-7zM12.5 5v14l8-7z", true],
  select: ["M6 3.5l12.5 8.2-6 1.3-3 6z"],
  disc: ["M12 4.5a7.5 7.5 0 1 0 .01 0z"],
  rectangle: ["M4 6.5h16v11H4z"],
  goal: ["M6 21V4h11.5l-3 4 3 4H6"],
  world: ["M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5"],
  flock: ["M12 3v4M12 17v4M3 12h4M17 12h4M12 8.5a3.5 3.5 0 1 0 .01 0z"],
  undo: ["M9 5L4 10l5 5M4 10h10a5.5 5.5 0 0 1 0 11h-3"],
  remove: ["M6 6l12 12M18 6L6 18"],
  range: ["M4 7v10M20 7v10M4 12h16"],
  plus: ["M12 5v14M5 12h14"],
  copy: ["M8.5 8.5h11v12h-11zM15.5 8.5v-5h-11v12h4"],
  save: ["M12 4v11M7 10.5l5 5 5-5M4.5 20h15"],
  keys: ["M3 6.5h18v11H3zM7 10h.01M12 10h.01M17 10h.01M8 14h8"],
  chart: ["M4 4v16h16M7.5 15l4-5 3.5 3 4.5-7"],
  before: ["M15 5l-7 7 7 7"],
  after: ["M9 5l7 7-7 7"],
};

export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "on") {
      for (const [event, act] of Object.entries(value)) {
        element.addEventListener(event, act);
      }
    } else if (name in element && !name.startsWith("aria")) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

export function icon(name) {
  const [path, filled = false] = PICTURES[name];
  const space = "http://www.w3.org/2000/svg";
  const picture = document.createElementNS(space, "svg");
  const line = document.createElementNS(space, "path");
  for (
    const [key, value] of [["viewBox", "0 0 24 24"], ["aria-hidden", "true"], [
      "focusable",
      "false",
    ]]
  ) {
    picture.setAttribute(key, value);
  }
  picture.classList.toggle("filled", filled);
  line.setAttribute("d", path);
  picture.append(line);
  return picture;
}

// A button with an icon; `label` is its name for everyone, `words` those that stand
// beside the icon.
export function button(picture, label, act, words = "", properties = {}) {
  const parts = [
    ...(picture ? [icon(picture)] : []),
    ...(words ? [make("span", { textContent: words })] : []),
  ];
  const named = words && label === words ? {} : { "aria-label": label };
  return make("button", {
    type: "button",
    title: label,
    on: { click: act },
    ...named,
    ...properties,
  }, ...parts);
}

export function setIcon(element, name, label) {
  element.firstChild.replaceWith(icon(name));
  element.title = label;
  element.setAttribute("aria-label", label);
}

// randomUUID is only there for pages from this machine or by https, which a notebook
// need not be.
export const randomName = () =>
  Array.from(crypto.getRandomValues(new Uint32Array(4)), (part) => part.toString(36))
    .join("-");

export const spaced = (name) => name.replaceAll("_", " ");

const RAISED = { 2: "²", 3: "³", 4: "⁴" };
export const unitText = (unit) =>
  (unit ?? "").replace(/\^([234])/g, (_, power) => RAISED[power]);

// A number as people read it: at most `digits` significant ones.
export function short(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (typeof value !== "number") return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) {
    return value.toExponential(digits - 2).replace("e+", "e");
  }
  return String(Number(value.toPrecision(digits)));
}

export const asNumber = (
  value,
) => (typeof value === "string" ? Number(value.replace("inf", "Infinity")) : value);

// Calls `act` at once and then at most every `wait` ms, the last call always.
export function paced(act, wait) {
  let timer = null;
  let latest = null;
  const fire = () => {
    timer = null;
    if (latest) {
      const given = latest;
      latest = null;
      timer = setTimeout(fire, wait);
      act(...given);
    }
  };
  return (...given) => {
    latest = given;
    if (timer === null) fire();
  };
}

// Sets a text only where it is another one: most messages change little.
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
