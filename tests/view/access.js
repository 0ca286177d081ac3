// What is wrong with the page for those who see, hear or point otherwise: lists that
// should be empty.
((wanted) => {
  const box = (one) => one.getBoundingClientRect();
  const shown = (one) =>
    one.checkVisibility({ visibilityProperty: true }) && box(one).width > 0;
  const all = (selector) => [...document.querySelectorAll(selector)];
  const controls = all("button, input, select, textarea, summary, canvas[tabindex='0']")
    .filter(shown);
  const short = (one) => one.outerHTML.slice(0, 160);

  const probe = document.createElement("canvas").getContext("2d", {
    willReadFrequently: true,
  });
  const parse = (colour) => {
    probe.clearRect(0, 0, 1, 1);
    probe.fillStyle = colour;
    probe.fillRect(0, 0, 1, 1);
    return [...probe.getImageData(0, 0, 1, 1).data];
  };
  const linear = (
    value,
  ) => (value / 255 <= 0.04045
    ? value / 255 / 12.92
    : ((value / 255 + 0.055) / 1.055) ** 2.4);
  const luminance = ([red, green, blue]) =>
    0.2126 * linear(red) + 0.7152 * linear(green) + 0.0722 * linear(blue);
  const contrast = (first, second) => {
    const [low, high] = [luminance(first), luminance(second)].sort((a, b) => a - b);
    return (high + 0.05) / (low + 0.05);
  };
  const behind = (one) => {
    const colour = parse(getComputedStyle(one).backgroundColor);
    return colour[3] === 255 ? colour : behind(one.parentElement);
  };

  const checks = {
    nameless() {
      const name = (one) =>
        one.getAttribute("aria-label") || one.labels?.[0]?.textContent ||
        one.textContent;
      return [...controls, ...all("[role=img], aside, dialog")].filter((one) =>
        !name(one)?.trim()
      ).map(short);
    },
    doubled() {
      const ids = all("[id]").map((one) => one.id);
      return ids.filter((id, i) => ids.indexOf(id) !== i);
    },
    disordered: () => all("[tabindex]").filter((one) => one.tabIndex > 0).map(short),
    unmarked() {
      const plain = (one) => {
        one.focus({ focusVisible: true });
        const { outlineStyle, outlineWidth } = getComputedStyle(one);
        return outlineStyle === "none" || parseFloat(outlineWidth) < 2;
      };
      return controls.filter((one) => !one.disabled && plain(one)).map(short);
    },
    faint() {
      const found = [];
      const walk = document.createTreeWalker(
        document.querySelector("main"),
        NodeFilter.SHOW_TEXT,
      );
      while (walk.nextNode()) {
        const one = walk.currentNode.parentElement;
        if (
          !walk.currentNode.data.trim() || one.closest(":disabled") ||
          !one.checkVisibility()
        ) continue;
        const ratio = contrast(parse(getComputedStyle(one).color), behind(one));
        if (ratio < 4.5) found.push(`${ratio.toFixed(2)} ${short(one)}`);
      }
      return found;
    },
    faintly_drawn() {
      const { colours } = boidsweep.view.stage;
      const pairs = [
        ["boid", "ground", 3],
        ["boid", "stage", 3],
        ["chosen", "ground", 3],
        ["goal", "ground", 3],
        ["muted", "stage", 4.5],
      ];
      const ratio = ([front, back]) =>
        contrast(parse(colours[front]), parse(colours[back]));
      return pairs.filter((pair) => ratio(pair) < pair[2]).map((pair) =>
        `${pair} ${ratio(pair)}`
      );
    },
    overflowing() {
      const wide = (one) =>
        one.scrollWidth > one.clientWidth + 1 &&
        getComputedStyle(one).overflowX !== "visible";
      const places = [
        document.scrollingElement,
        ...all(".boidsweep, .layout > *, dialog[open]"),
      ];
      return places.filter(wide).map((one) =>
        `${one.className || one.tagName}: ${one.scrollWidth} in ${one.clientWidth}`
      );
    },
    small() {
      const target = (one) =>
        box(
          one.type === "checkbox"
            ? (one.closest("label") ?? one.closest(".field"))
            : one,
        );
      const tiny = (one) => target(one).height < 43.5 || target(one).width < 43.5;
      return controls.filter(tiny).map((one) =>
        `${target(one).width} x ${target(one).height} ${short(one)}`
      );
    },
  };
  return Object.fromEntries(
    wanted.map((name) => [name, checks[name]()]).filter(([, found]) => found.length),
  );
});
