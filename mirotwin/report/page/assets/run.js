// The time of a run's page: the slider, what it moves, the keys. `window.run.show(index)` shows a control period.
(() => {
  "use strict";
  const data = JSON.parse(document.getElementById("page-data").textContent);
  const byId = (id) => document.getElementById(id);
  const floats = (text) => {
    const bytes = Uint8Array.from(atob(text), (one) => one.charCodeAt(0));
    const view = new DataView(bytes.buffer);
    return Float64Array.from({ length: bytes.length / 8 }, (_, at) => view.getFloat64(8 * at, true));
  };
  const robots = data.robots.map((robot) => ({
    ...robot,
    truth: robot.truth.map(floats),
    reference: robot.reference.map(floats),
    measured: robot.measured.map(floats),
  }));
  const last = data.ticks.length - 1;
  const slider = byId("time");
  const run = { index: 0, robot: 0, last, robots, show };
  window.run = run;

  // How far each robot has come along its path, for the trail.
  const trails = [...document.querySelectorAll(".trail")].map((line) => {
    const [xs, ys] = robots[Number(line.dataset.robot)].truth;
    const lengths = new Float64Array(xs.length);
    for (let at = 1; at < xs.length; at += 1) {
      lengths[at] = lengths[at - 1] + (100 * Math.hypot(xs[at] - xs[at - 1], ys[at] - ys[at - 1]) || 0);
    }
    return { line, lengths };
  });

  const DEGREES = 180 / Math.PI;
  function place(id, postures, index) {
    const element = byId(id);
    if (!element) return;
    const [x, y, theta] = postures.map((one) => one[index]);
    element.style.display = Number.isNaN(x) ? "none" : "";
    if (!Number.isNaN(x)) element.setAttribute("transform", `translate(${100 * x} ${100 * y}) rotate(${theta * DEGREES})`);
  }

  const wrapped = (angle) => Math.atan2(Math.sin(angle), Math.cos(angle));
  function row(id, x, y, theta) {
    const cells = byId(id)?.querySelectorAll("td");
    if (!cells) return;
    const texts = Number.isNaN(x) ? ["–", "–", "–"] : [(100 * x).toFixed(2), (100 * y).toFixed(2), (wrapped(theta) * DEGREES).toFixed(2)];
    cells.forEach((cell, at) => { cell.textContent = texts[at]; });
  }

  function tell(index) {
    const { truth, reference, measured, name } = robots[run.robot];
    const at = (postures) => postures.map((one) => one[index]);
    byId("now-name").textContent = name;
    row("now-truth", ...at(truth));
    row("now-measured", ...at(measured));
    row("now-reference", ...at(reference));
    row("now-error", ...at(truth).map((value, axis) => value - reference[axis][index]));
    if (!data.pairs) return;
    const other = at(robots[run.robot + data.pairs].truth);
    row("now-other", ...other);
    row("now-apart", ...at(truth).map((value, axis) => other[axis] - value));
  }

  function tellLink(begin) {
    const list = byId("link-now");
    if (!list) return;
    const end = begin + data.period_ticks;
    const items = [];
    for (const [from, to, lane, kind, text] of data.marks) {
      if (from >= end) break;
      if (to < begin) continue;
      const item = document.createElement("li");
      item.className = `kind-${data.kinds[kind]}`;
      item.textContent = `${(from / data.ticks_per_s).toFixed(4)} s  ${data.lanes[lane]}: ${text}`;
      items.push(item);
      if (items.length === 12) break;
    }
    list.replaceChildren(...items);
  }

  function showCamera(tick) {
    const picture = byId("camera");
    if (!picture) return;
    const of = data.frames.filter(([network, exposed]) => network === robots[run.robot].network && exposed <= tick);
    const shown = of.at(-1) ?? data.frames.find(([network]) => network === robots[run.robot].network);
    picture.hidden = !shown;
    if (!shown) return;
    const source = `data:image/jpeg;base64,${shown[2]}`;
    if (picture.src !== source) picture.src = source;
    byId("camera-time").textContent = `Camera of net${shown[0]}, exposed at ${(shown[1] / data.ticks_per_s).toFixed(3)} s`;
  }

  function show(wanted) {
    if (last < 0) return;
    const index = Math.max(0, Math.min(last, Math.round(wanted)));
    const tick = data.ticks[index];
    const time = tick / data.ticks_per_s;
    run.index = index;
    robots.forEach((robot, number) => {
      place(`truth-${number}`, robot.truth, index);
      place(`reference-${number}`, robot.reference, index);
      place(`measured-${number}`, robot.measured, index);
    });
    for (const { line, lengths } of trails) line.style.strokeDasharray = `${lengths[index]} ${lengths[last] + 1000}`;
    slider.value = `${index}`;
    const said = `${time.toFixed(3)} s`;
    slider.setAttribute("aria-valuetext", `${said}, control period ${data.first + index}`);
    byId("clock").textContent = `${said} · period ${data.first + index}`;
    tell(index);
    tellLink(tick);
    showCamera(tick);
    for (const cursor of window.plots.cursors) cursor.location = time;
  }

  const indexAt = (tick) => Math.floor((tick - data.ticks[0]) / data.period_ticks);
  // Which robot the plots show.
  byId("robot")?.addEventListener("change", (event) => {
    run.robot = Number(event.target.value);
    for (const model of window.plots.models) {
      const of = model.tags.find((tag) => `${tag}`.startsWith("robot:"));
      if (of) model.visible = of === `robot:${run.robot}`;
    }
    show(run.index);
  });

  window.transport({ run, data, indexAt, step: data.period_ticks });
})();
