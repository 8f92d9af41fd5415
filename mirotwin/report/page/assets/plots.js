// Puts the figures into their places and gives them the colours of the theme. `window.plots`: what other scripts move.
(() => {
  "use strict";
  const saved = JSON.parse(document.getElementById("page-document").textContent);
  const plots = { models: [], cursors: [], figures: {}, ready: null };
  window.plots = plots;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

  plots.paint = () => {
    for (const model of plots.models) {
      const changes = {};
      for (const tag of model.tags) {
        const at = `${tag}`.indexOf("=");
        if (at > 0) changes[tag.slice(0, at)] = colour(tag.slice(at + 1));
      }
      if (Object.keys(changes).length) model.setv(changes);
    }
  };

  // To the keyboard a figure is a picture: none of its keys does anything here, and its focus can hardly be seen.
  const passOver = (root) => {
    for (const one of root.querySelectorAll("*")) {
      if (one.shadowRoot) passOver(one.shadowRoot);
      if (one.getAttribute("tabindex") === "0") one.tabIndex = -1;
    }
  };

  const embed = async () => {
    await Bokeh.embed.embed_items(saved.docs, saved.items);
    const [doc] = Bokeh.documents;
    if (!doc) return;
    plots.models = [...doc._all_models.values()].filter((model) => model.tags.length);
    plots.cursors = plots.models.filter((model) => model.tags.includes("cursor"));
    for (const [id, name] of Object.entries(saved.items[0].roots)) plots.figures[name] = doc.get_model_by_id(id);
    plots.paint();
    document.querySelectorAll(".plot").forEach(passOver);
  };

  plots.ready = embed();
  document.addEventListener("themechange", plots.paint);
})();
