// The time of a board's page: the slider, what it moves, the keys. `window.run.show(index)` shows a moment.
(() => {
  "use strict";
  const data = JSON.parse(document.getElementById("page-data").textContent);
  const byId = (id) => document.getElementById(id);
  const all = (selector) => [...document.querySelectorAll(selector)];
  const slider = byId("time");
  const last = Number(slider.max);
  const run = { index: 0, last, show };
  window.run = run;

  const tickOf = (index) => Math.min(data.end, data.first + index * data.step);
  const indexAt = (tick) => Math.ceil((tick - data.first) / data.step);
  const inSeconds = (tick) => `${(tick / data.ticks_per_s).toFixed(3)} s`;

  // The number of entries of a sorted list that are not later.
  function passed(ticks, tick) {
    let low = 0, high = ticks.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (ticks[middle] <= tick) low = middle + 1; else high = middle;
    }
    return low;
  }

  const said = (value) => typeof value !== "number" ? `${value}` : Number.isInteger(value) ? `${value}` : `${Math.abs(value) < 0.01 ? Number(value.toFixed(5)) : Number(value.toPrecision(5))}`;
  const valueAt = (path, tick) => {
    const [ticks, values] = data.values[path];
    return values[Math.max(0, passed(ticks, tick) - 1)];
  };

  const cells = all("[data-path]");
  for (const cell of cells.filter((one) => "end" in one.dataset)) cell.textContent = said(valueAt(cell.dataset.path, data.end));
  const moving = cells.filter((one) => !("end" in one.dataset));
  const moments = all(".moment");
  const rows = all(".serial tr[data-tick]");
  const rowTicks = rows.map((row) => Number(row.dataset.tick));

  // Digits of seven segments: two hex digits each, a lowest, dp highest.
  const SEGMENTS = ["M6 3h8", "M16.5 5.5v11", "M16.5 21.5v11", "M6 35h8", "M3.5 21.5v11", "M3.5 5.5v11", "M6 19h8", "M21 35h0"];
  const digits = all("[data-segments]").map((svg) => {
    const { segments: path } = svg.dataset;
    const count = Math.max(1, valueAt(path, data.end).length / 2);
    svg.setAttribute("viewBox", `0 0 ${24 * count} 38`);
    svg.innerHTML = Array.from({ length: count }, (_, at) => `<g transform="translate(${24 * at} 0)">${SEGMENTS.map((d) => `<path d="${d}"/>`).join("")}</g>`).join("");
    return { path, end: "end" in svg.dataset, lines: [...svg.querySelectorAll("path")] };
  });
  function light(tick) {
    for (const { path, end, lines } of digits) {
      const codes = valueAt(path, end ? data.end : tick);
      lines.forEach((line, at) => line.classList.toggle("lit", (parseInt(codes.substr(2 * (at >> 3), 2), 16) >> (at & 7)) & 1));
    }
  }

  // A car's way: its place at each tick at which one of its coordinates was another one.
  const cars = all(".plane").map((plane) => {
    const [x, y, heading] = data.ways[plane.dataset.car];
    const ticks = [...new Set([...data.values[x][0], ...data.values[y][0]])].sort((one, other) => one - other);
    const points = ticks.map((tick) => `${valueAt(x, tick)},${valueAt(y, tick)}`);
    plane.querySelector(".ahead").setAttribute("points", points.join(" "));
    const room = Number(plane.dataset.room);
    const body = plane.querySelector(".car");
    const reach = body.getBBox().width / 2;
    let [left, bottom, right, top] = [Infinity, Infinity, -Infinity, -Infinity];
    for (const one of plane.querySelectorAll("rect, line, polyline")) {
      const box = one.getBBox();
      const grown = one.matches(".ahead") ? reach : 0;
      if (!one.matches(".trail")) {
        [left, bottom] = [Math.min(left, box.x - grown), Math.min(bottom, box.y - grown)];
        [right, top] = [Math.max(right, box.x + box.width + grown), Math.max(top, box.y + box.height + grown)];
      }
    }
    plane.setAttribute("viewBox", `${left - room} ${-top - room} ${right - left + 2 * room} ${top - bottom + 2 * room}`);
    return { ticks, heading, points, trail: plane.querySelector(".trail"), body };
  });
  function drive(tick) {
    for (const { ticks, points, trail, body, heading } of cars) {
      const count = Math.max(1, passed(ticks, tick));
      trail.setAttribute("points", points.slice(0, count).join(" "));
      body.setAttribute("transform", `translate(${points[count - 1].replace(",", " ")}) rotate(${valueAt(heading, tick)})`);
    }
  }

  function tellEvents(tick) {
    const list = byId("events-now");
    if (!list) return;
    const near = data.marks.filter(([from]) => from <= tick).slice(-5);
    const next = data.marks.filter(([from]) => from > tick).slice(0, 2);
    list.replaceChildren(...[...near, ...next].map(([from, lane, kind, text]) => {
      const item = document.createElement("li");
      item.className = `kind-${kind}${from > tick ? " ahead" : ""}`;
      item.textContent = `${inSeconds(from)}  ${lane}: ${text}`;
      return item;
    }));
  }

  function show(wanted) {
    const index = Math.max(0, Math.min(last, Math.round(wanted)));
    const tick = tickOf(index);
    run.index = index;
    slider.value = `${index}`;
    slider.setAttribute("aria-valuetext", inSeconds(tick));
    byId("clock").textContent = inSeconds(tick);
    for (const moment of moments) moment.textContent = inSeconds(tick);
    for (const cell of moving) cell.textContent = said(valueAt(cell.dataset.path, tick));
    const current = passed(rowTicks, tick) - 1;
    rows.forEach((row, at) => { row.classList.toggle("past", at <= current); row.classList.toggle("current", at === current); });
    tellEvents(tick);
    drive(tick);
    light(tick);
    for (const cursor of window.plots.cursors) cursor.location = tick / data.ticks_per_s;
    document.dispatchEvent(new CustomEvent("moment", { detail: tick }));
  }

  const jumps = [...new Set(data.marks.map(([from]) => indexAt(from)))].sort((one, other) => one - other);
  const narrow = matchMedia("(max-width: 700px)");
  const label = () => {
    for (const [name, plot] of Object.entries(window.plots.figures)) if (name.startsWith("plot-value")) plot.min_border_left = narrow.matches ? 60 : 136;
    for (const model of window.plots.models) if (model.tags.includes("wide")) model.visible = !narrow.matches;
  };
  narrow.addEventListener("change", label);
  window.transport({ run, data, indexAt, step: data.step, jumps, drawn: label });
})();
