// The dialog that says what mouse, keys and colors do, and leads to the API.

import { byId } from "./dom.js";

export class Help {
  #dialog = byId("help-dialog");

  constructor() {
    byId("open-help").addEventListener("click", () => this.open());
  }

  open() {
    if (!this.#dialog.open) this.#dialog.showModal();
  }
}
