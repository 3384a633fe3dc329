// Starts the page.

import { showEmpty } from "./chooser.js";
import { Page } from "./page.js";

function begin() {
  try {
    return new Page();
  } catch (error) {
    showEmpty("The map cannot be drawn here", error.message);
    return undefined;
  }
}

export const page = begin();
page?.start();
