// Browsers refuse workers to pages from a disk. There the search runs in a hidden frame, which has a window of its own.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(address) {
      super();
      const frame = document.createElement("iframe");
      frame.hidden = true;
      this.window = new Promise((loaded) => {
        frame.addEventListener("load", () => {
          const script = frame.contentDocument.createElement("script");
          frame.contentWindow.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
          script.addEventListener("load", () => loaded(frame.contentWindow));
          script.src = address;
          frame.contentDocument.body.append(script);
        }, { once: true });
      });
      document.body.append(frame);
    }

    postMessage(data) {
      this.window.then((inner) => inner.dispatchEvent(new MessageEvent("message", { data })));
    }
  };
}
