// The command that makes a row of a campaign again. `window.campaign.show(run)` shows that of a run.
(() => {
  "use strict";
  const data = JSON.parse(document.getElementById("page-data").textContent);
  const field = document.getElementById("run");
  const rowOf = new Map(data.runs.map((run, row) => [run, row]));

  function show(run) {
    const row = rowOf.get(run);
    let text = `There is no run ${run}.`;
    if (row !== undefined) {
      const [arm, seed, drawn] = data.rows[row];
      text = data.arms[arm] ? [data.arms[arm], drawn, `--seed ${seed}`].filter(Boolean).join(" ") : "The results of this version do not say it.";
    }
    document.getElementById("line").textContent = text;
    field.value = `${run}`;
  }
  window.campaign = { show };

  field.addEventListener("input", () => { if (field.value !== "") show(field.valueAsNumber); });
  document.addEventListener("click", (event) => {
    const button = event.target.closest("[data-run]");
    if (!button) return;
    show(Number(button.dataset.run));
    document.getElementById("again").scrollIntoView({ block: "center" });
  });
  show(data.runs[0]);
  window.plots.ready.then(() => { document.body.dataset.ready = "true"; });
})();
