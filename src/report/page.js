(() => {
  // Values of a drawing where somebody points: the page is complete without.
  const tip = document.body.appendChild(document.createElement("div"));
  tip.id = "tip";
  tip.hidden = true;
  const words = (text, count) => {
    const parts = text.split(" ");
    return [...parts.slice(0, count), parts.slice(count).join(" ")];
  };
  const short = (value) => String(Number(value.toPrecision(4))).replace("-", "−");
  const told = (label, value) => {
    const [name, unit] = label.split(" / ");
    if (unit) return `${name} ${short(value)} ${unit}`;
    if (!/cycles$/.test(label)) return `${label} ${short(value)}`;
    return value && label !== "cycles" ? `${short(value)}·${label}` : `${short(value)} cycles`;
  };
  const between = (part, low, high, kind) => (kind === "log" ? low * (high / low) ** part : low + part * (high - low));
  // Value at a place of an axis: place of its ends, their values, kind, where 0 stands, label.
  const at = (axis, place) => {
    const [begin, end, low, high, kind, zero, label] = words(axis, 6);
    const value = between((place - begin) / (end - begin), +low, +high, kind);
    return told(label, +zero && value < 1.05 * zero ? 0 : value);
  };
  const points = (svg) => (svg.points ??= [...svg.querySelectorAll("polyline, circle")].flatMap((mark) => {
    const style = /\b[sc](\d+)\b/.exec(mark.getAttribute("class"))?.[1];
    if (!style) return [];
    // Not those of the legend.
    const inside = ([x, y]) => [[x, svg.dataset.x], [y, svg.dataset.y]].every(([place, axis]) => {
      const [begin, end] = axis.split(" ").map(Number);
      return (place - begin) * (place - end) <= 0;
    });
    const list = mark.getAttribute("points")?.trim().split(/\s+/) ?? [`${mark.getAttribute("cx")},${mark.getAttribute("cy")}`];
    return list.map((point) => [...point.split(",").map(Number), style]).filter(inside);
  }));
  const ofChart = (svg, x, y) => {
    const far = (point) => Math.hypot(point[0] - x, point[1] - y);
    const near = points(svg).reduce((best, point) => (best && far(best) <= far(point) ? best : point), null);
    if (!near || far(near) > 90) return "";
    const name = svg.dataset.names.split("\n").find((name) => name.startsWith(`s${near[2]} `));
    return [name && words(name, 1)[1], at(svg.dataset.x, near[0]), at(svg.dataset.y, near[1])].filter(Boolean).join("\n");
  };
  const pixels = (image) => (image.pixels ??= new Promise((ready) => {
    const copy = new Image();
    copy.onload = () => {
      const canvas = Object.assign(document.createElement("canvas"), { width: copy.width, height: copy.height });
      const context = canvas.getContext("2d");
      context.drawImage(copy, 0, 0);
      ready(context.getImageData(0, 0, copy.width, copy.height));
    };
    copy.src = image.getAttribute("href");
  }));
  const ofMap = async (svg, x, y) => {
    const [left, top, width, height, wide, high] = svg.dataset.map.split(" ").map(Number);
    const [u, v] = [(x - left) / width, (y - top) / height];
    if (u < 0 || u >= 1 || v < 0 || v >= 1) return "";
    const [field, colours] = await Promise.all([".field", ".colours"].map((name) => pixels(svg.querySelector(name))));
    const cell = 4 * (Math.floor(v * field.height) * field.width + Math.floor(u * field.width));
    const same = (k) => [0, 1, 2].every((c) => colours.data[4 * k + c] === field.data[cell + c]);
    const place = [...Array(colours.height).keys()].find(same);
    const [low, most, kind, label] = words(svg.dataset.scale, 3);
    const value = field.data[cell + 3] === 0 ? "hole" : place === undefined ? svg.dataset.nothing
      : told(label, between(1 - place / (colours.height - 1), +low, +most, kind));
    return `x ${short(u * wide)} mm, y ${short((1 - v) * high)} mm\n${value}`;
  };
  addEventListener("pointermove", async (event) => {
    const svg = event.target.closest?.("svg[data-x], svg[data-map]");
    tip.hidden = !svg;
    if (!svg) return;
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const text = await (svg.dataset.map ? ofMap : ofChart)(svg, x, y);
    tip.hidden = !text;
    tip.textContent = text;
    tip.style.left = `${Math.min(event.pageX + 14, scrollX + innerWidth - tip.offsetWidth - 8)}px`;
    tip.style.top = `${event.pageY + 18}px`;
  });
  // Browsers that do not know how the style sheet opens what is folded.
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => (part.open = true)));
})();
