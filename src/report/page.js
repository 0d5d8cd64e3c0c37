(() => {
  // What a page can do beside being complete: values where somebody points, charts enlarged, curves switched, states chosen.
  const all = (part, of = document) => [...of.querySelectorAll(part)];
  const set = (element, attributes) => Object.entries(attributes).forEach((entry) => element.setAttribute(...entry));
  const short = (value) => String(Number(value.toPrecision(4))).replace("-", "−");
  const told = (label, value, [name, unit] = label.split(" / ")) =>
    unit ? `${name} ${short(value)} ${unit}` : !/cycles$/.test(label) ? `${label} ${short(value)}`
      : value && label !== "cycles" ? `${short(value)}·${label}` : `${short(value)} cycles`;
  // An axis: places of its ends, their values, whether it is logarithmic, where 0 stands on it, label.
  const axis = (text) => {
    const [begin, end, low, high, kind, zero, ...label] = text.split(" ");
    return { begin: +begin, end: +end, low: +low, high: +high, log: kind === "log", zero: +zero, label: label.join(" ") };
  };
  const valueAt = ({ begin, end, low, high, log }, place, part = (place - begin) / (end - begin)) =>
    log ? low * (high / low) ** part : low + part * (high - low);
  const placeOf = ({ begin, end, low, high, log }, value) =>
    begin + (end - begin) * (log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
  const number = (of, value) => (of.zero && value < 1.05 * of.zero ? 0 : value);
  const place = (svg, event) => new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
  // Charts: what they are made of, as it was drawn, and the part of it that is seen.
  const chart = (svg) => (svg.chart ??= (() => {
    const whole = [axis(svg.dataset.x), axis(svg.dataset.y)];
    const marks = all("g > *", svg).flatMap((mark) => ["points", "cx", "cy", "d"].map((name) => [mark, name, mark.getAttribute(name)]));
    return { whole, seen: whole, marks: marks.filter((mark) => mark[2]) };
  })());
  const range = (first, last) => [...Array(Math.max(0, last - first + 1)).keys()].map((k) => first + k);
  const ticks = ({ low, high, log }) => {
    const [least, most] = [Math.log10(low), Math.log10(high)].map(Math.floor);
    if (log && high >= 10 * low) {
      const parts = most - least > 2 ? [1] : [1, 2, 5];
      const powers = range(least, most).filter((k) => (most - k) % Math.ceil((most - least) / 6) === 0);
      return powers.flatMap((k) => parts.map((part) => part * 10 ** k)).filter((value) => value >= low && value <= high);
    }
    const step = [1, 2, 5, 10].map((part) => part * 10 ** Math.floor(Math.log10((high - low) / 6))).find((step) => 6.001 * step >= high - low);
    return range(Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)).map((k) => k * step);
  };
  const relabel = (svg, of, name) => {
    const group = svg.parentNode.querySelector(`[data-ticks=${name}]`);
    const model = (group.model ??= [...group.children].slice(0, 3));
    group.replaceChildren(...ticks(of).flatMap((value) => model.map((part) => {
      const copy = part.cloneNode(true);
      const at = placeOf(of, value);
      for (const key of copy.localName === "text" ? [name] : [`${name}1`, `${name}2`]) copy.setAttribute(key, at);
      if (copy.localName === "text") copy.textContent = short(number(of, value));
      return copy;
    })));
  };
  const show = (svg, seen) => {
    const { whole, marks } = Object.assign(chart(svg), { seen });
    const map = [0, 1].map((d) => (at) => Math.max(-1e5, Math.min(1e5, placeOf(seen[d], valueAt(whole[d], at)))).toFixed(2));
    const [pair, step] = [/([^\s,M]+)[, ]([^\s,VHM]+)/g, /([VH])([^VHM]+)/g];
    const moved = (text) => text.replace(pair, (all, x, y) => map[0](+x) + all[x.length] + map[1](+y)).replace(step, (_, key, to) => key + map[+(key === "V")](+to));
    marks.forEach(([mark, name, text]) => set(mark, { [name]: name[0] === "c" ? map[+(name === "cy")](+text) : moved(text) }));
    seen.forEach((of, d) => relabel(svg, of, "xy"[d]));
  };
  const ofChart = (svg, { x, y }) => {
    const { seen } = chart(svg);
    const points = all("g:not(.off) > polyline, g:not(.off) > circle", svg).flatMap((mark) => {
      const list = mark.getAttribute("points")?.trim().split(/\s+/) ?? [`${mark.getAttribute("cx")},${mark.getAttribute("cy")}`];
      return list.map((point) => [...point.split(",").map(Number), mark.parentNode.dataset.name]);
    }).filter((point) => seen.every((of, d) => (point[d] - of.begin) * (point[d] - of.end) <= 0));
    const far = (point) => Math.hypot(point[0] - x, point[1] - y);
    const near = points.reduce((best, point) => (best && far(best) <= far(point) ? best : point), null);
    if (!near || far(near) > 25) return "";
    return [near[2], ...seen.map((of, d) => told(of.label, number(of, valueAt(of, near[d]))))].filter(Boolean).join("\n");
  };
  let drag = null;
  addEventListener("pointerdown", (event) => {
    const svg = event.target.closest?.("svg.plot");
    if (!svg || event.button !== 0 || event.pointerType !== "mouse") return;
    drag = { svg, frame: svg.appendChild(document.createElementNS(svg.namespaceURI, "rect")), from: place(svg, event) };
    set(drag.frame, { class: "frame" });
    event.preventDefault();
  });
  addEventListener("pointerup", (event) => {
    if (!drag) return;
    const { svg, frame, from } = drag;
    const to = place(svg, event);
    frame.remove();
    drag = null;
    if (Math.abs(to.x - from.x) < 6 || Math.abs(to.y - from.y) < 6) return;
    show(svg, chart(svg).seen.map((of, d) => {
      const [low, high] = [from["xy"[d]], to["xy"[d]]].map((at) => valueAt(of, at)).sort((a, b) => a - b);
      return { ...of, low: Math.max(low, of.low), high: Math.min(high, of.high) };
    }));
  });
  addEventListener("dblclick", (event) => {
    const svg = event.target.closest?.("svg.plot");
    if (svg?.chart) show(svg, svg.chart.whole);
  });
  // Curves are switched by their names in the legend.
  for (const key of all(".key")) {
    set(key, { role: "button", tabindex: 0, "aria-pressed": true });
    const turn = () => {
      const off = key.classList.toggle("off");
      set(key, { "aria-pressed": !off });
      all("svg.plot > g", key.parentNode).filter((g) => g.dataset.name === key.dataset.name).forEach((g) => g.classList.toggle("off", off));
    };
    key.addEventListener("click", turn);
    key.addEventListener("keydown", (event) => event.key === "Enter" && turn());
  }
  // One of several states at a time, chosen by a slider.
  for (const states of all("details.states")) {
    const each = all(".state", states);
    const slider = Object.assign(document.createElement("input"), { type: "range", max: each.length - 1, value: each.length - 1 });
    const choose = () => {
      each.forEach((state, k) => (state.hidden = k !== +slider.value));
      slider.setAttribute("aria-valuetext", each[slider.value].firstElementChild.textContent);
    };
    slider.addEventListener("input", choose);
    slider.setAttribute("aria-label", states.firstElementChild.textContent);
    states.firstElementChild.after(slider);
    states.open = true;
    choose();
  }
  // Maps: the value of a cell is told by its colour.
  const pixels = (image) => (image.pixels ??= (async () => {
    const copy = Object.assign(new Image(), { src: image.getAttribute("href") });
    await copy.decode();
    const context = new OffscreenCanvas(copy.width, copy.height).getContext("2d");
    context.drawImage(copy, 0, 0);
    return context.getImageData(0, 0, copy.width, copy.height);
  })());
  const ofMap = async (map, { x, y }) => {
    const [left, top, width, height, wide, high] = map.dataset.map.split(" ").map(Number);
    const [u, v] = [(x - left) / width, (y - top) / height];
    if (u < 0 || u >= 1 || v < 0 || v >= 1) return "";
    const [field, colours] = await Promise.all([".field", ".colours"].map((name) => pixels(map.querySelector(name))));
    const cell = 4 * (Math.floor(v * field.height) * field.width + Math.floor(u * field.width));
    const at = range(0, colours.height - 1).find((k) => [0, 1, 2].every((c) => colours.data[4 * k + c] === field.data[cell + c]));
    const scale = axis(map.dataset.scale);
    const value = field.data[cell + 3] === 0 ? "hole" : at === undefined ? map.dataset.nothing
      : told(scale.label, valueAt({ ...scale, begin: colours.height - 1, end: 0 }, at));
    return `x ${short(u * wide)} mm, y ${short((1 - v) * high)} mm\n${value}`;
  };
  const tip = Object.assign(document.body.appendChild(document.createElement("div")), { id: "tip", hidden: true });
  addEventListener("pointermove", async (event) => {
    if (drag) {
      const [{ from, frame }, to] = [drag, place(drag.svg, event)];
      set(frame, { x: Math.min(from.x, to.x), y: Math.min(from.y, to.y), width: Math.abs(to.x - from.x), height: Math.abs(to.y - from.y) });
    }
    const part = event.target.closest?.("svg.plot, g.map");
    const text = part ? await (part.dataset.map ? ofMap : ofChart)(part, place(part, event)) : "";
    Object.assign(tip, { hidden: !text, textContent: text });
    tip.style.left = `${Math.min(event.pageX + 14, scrollX + innerWidth - tip.offsetWidth - 8)}px`;
    tip.style.top = `${event.pageY + 18}px`;
  });
  // Browsers that do not know how the style sheet opens what is folded.
  addEventListener("beforeprint", () => all("details").forEach((part) => (part.open = true)));
})();
