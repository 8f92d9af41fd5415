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
      lengths[at] = lengths[at - 1] + 100 * Math.hypot(xs[at] - xs[at - 1], ys[at] - ys[at - 1]);
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
  slider.addEventListener("input", () => { stop(); show(slider.valueAsNumber); });
  document.addEventListener("click", (event) => {
    const button = event.target.closest(".jump");
    if (button) { stop(); show(indexAt(Number(button.dataset.tick))); }
  });

  // Playing, at the speed of the robot times that of the list.
  let began = null;
  const play = byId("play");
  function stop() {
    began = null;
    play.setAttribute("aria-pressed", "false");
    play.setAttribute("aria-label", "Play");
  }
  function frame(now) {
    if (began === null) return;
    const speed = Number(byId("speed").value);
    const index = began.index + Math.floor(((now - began.at) * speed * data.ticks_per_s) / 1000 / data.period_ticks);
    if (index !== run.index) show(index);
    if (index >= last) stop(); else requestAnimationFrame(frame);
  }
  function toggle() {
    if (began !== null) { stop(); return; }
    if (run.index >= last) show(0);
    play.setAttribute("aria-pressed", "true");
    play.setAttribute("aria-label", "Pause");
    began = { index: run.index, at: performance.now() };
    requestAnimationFrame(frame);
  }
  play.addEventListener("click", toggle);
  byId("speed").addEventListener("change", () => { if (began) began = { index: run.index, at: performance.now() }; });

  const MOVES = {
    ArrowRight: () => run.index + 1, ArrowUp: () => run.index + 1,
    ArrowLeft: () => run.index - 1, ArrowDown: () => run.index - 1,
    Home: () => 0, End: () => last,
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("select, textarea")) return;
    const onSlider = event.target === slider;
    const vertical = event.key === "ArrowUp" || event.key === "ArrowDown";
    if (event.key in MOVES && (onSlider || !vertical)) {
      event.preventDefault();
      stop();
      show(MOVES[event.key]());
    } else if (event.key === " " && !event.target.closest("button, summary, a")) {
      event.preventDefault();
      toggle();
    }
  });

  // Which robot the plots show.
  byId("robot")?.addEventListener("change", (event) => {
    run.robot = Number(event.target.value);
    for (const model of window.plots.models) {
      const of = model.tags.find((tag) => `${tag}`.startsWith("robot:"));
      if (of) model.visible = of === `robot:${run.robot}`;
    }
    show(run.index);
  });

  for (const tick of data.failures) {
    const mark = document.createElement("i");
    mark.style.left = `${(100 * Math.max(0, Math.min(last, indexAt(tick)))) / Math.max(1, last)}%`;
    byId("marks").append(mark);
  }

  const begin = () => show(data.failures.length ? indexAt(data.failures[0]) : 0);
  begin();
  window.plots.ready.then(() => {
    for (const [name, plot] of Object.entries(window.plots.figures)) {
      byId(name).addEventListener("click", (event) => {
        if (event.target.closest?.(".bk-Toolbar, button")) return;
        const view = Bokeh.index.find_one?.(plot) ?? [...Bokeh.index].find((one) => one.model === plot);
        const box = view?.canvas_view?.el.getBoundingClientRect();
        if (!box) return;
        const time = view.frame.x_scale.invert(event.clientX - box.left);
        stop();
        show(indexAt(time * data.ticks_per_s));
      });
    }
    show(run.index);
    document.body.dataset.ready = "true";
  });
})();
