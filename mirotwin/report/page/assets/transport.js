// Moves a page through time: the slider, the play button, the keys, marks of failures, clicks in figures.
// `run`: `index` of the moment that is shown, of 0..`last`, and `show(index)`. `step`: ticks between two moments.
// `jumps`: moments that Shift with an arrow key goes to; without them it goes on by one. `drawn`: is called once
// the figures are there.
"use strict";
window.transport = ({ run, data, indexAt, step, jumps = [], drawn = () => {} }) => {
  const byId = (id) => document.getElementById(id);
  const { last, show } = run;
  const slider = byId("time"), play = byId("play");

  let began = null;
  function stop() {
    began = null;
    play.setAttribute("aria-pressed", "false");
    play.setAttribute("aria-label", "Play");
  }
  function frame(now) {
    if (began === null) return;
    const ticks = ((now - began.at) * Number(byId("speed").value) * data.ticks_per_s) / 1000;
    const index = began.index + Math.floor(ticks / step);
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
  slider.addEventListener("input", () => { stop(); show(slider.valueAsNumber); });
  document.addEventListener("click", (event) => {
    const button = event.target.closest(".jump");
    if (button) { stop(); show(indexAt(Number(button.dataset.tick))); }
  });

  const next = (far) => !(far && jumps.length) ? run.index + 1 : jumps.find((at) => at > run.index) ?? last;
  const before = (far) => !(far && jumps.length) ? run.index - 1 : jumps.findLast((at) => at < run.index) ?? 0;
  const MOVES = {
    ArrowRight: next, ArrowUp: () => next(false), ArrowLeft: before, ArrowDown: () => before(false),
    Home: () => 0, End: () => last,
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.closest("select, textarea")) return;
    const vertical = event.key === "ArrowUp" || event.key === "ArrowDown";
    if (event.key in MOVES && (event.target === slider || !vertical)) {
      event.preventDefault();
      stop();
      show(MOVES[event.key](event.shiftKey));
    } else if (event.key === " " && !event.target.closest("button, summary, a")) {
      event.preventDefault();
      toggle();
    }
  });

  for (const tick of data.failures) {
    const mark = document.createElement("i");
    mark.style.left = `${(100 * Math.max(0, Math.min(last, indexAt(tick)))) / Math.max(1, last)}%`;
    byId("marks").append(mark);
  }

  show(data.failures.length ? indexAt(data.failures[0]) : 0);
  window.plots.ready.then(() => {
    for (const [name, plot] of Object.entries(window.plots.figures)) {
      byId(name).addEventListener("click", (event) => {
        if (event.target.closest?.(".bk-Toolbar, button")) return;
        const view = Bokeh.index.find_one?.(plot) ?? [...Bokeh.index].find((one) => one.model === plot);
        const box = view?.canvas_view?.el.getBoundingClientRect();
        if (!box) return;
        stop();
        show(indexAt(view.frame.x_scale.invert(event.clientX - box.left) * data.ticks_per_s));
      });
    }
    drawn();
    show(run.index);
    document.body.dataset.ready = "true";
  });
};
