// Elements of the page. What a server or a file says is put in as text, never as markup.

export const byId = (id) => document.getElementById(id);

/** An element with properties, `data-` words and children; texts become text nodes. */
export function element(name, { data, ...properties } = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  Object.assign(made.dataset, data);
  made.append(...children.filter((child) => child !== undefined && child !== null));
  return made;
}

/** A dot in a color. */
export function dot(color) {
  const made = element("i");
  made.style.background = color;
  return made;
}

export function button(text, whenClicked, properties = {}) {
  const made = element("button", { type: "button", textContent: text, ...properties });
  made.addEventListener("click", whenClicked);
  return made;
}

/** Terms and what they are. */
export function terms(entries) {
  const shown = entries.filter(([, value]) => value !== undefined && value !== null);
  return element("dl", {}, ...shown.flatMap(([term, value]) => [element("dt", {}, term), element("dd", {}, value)]));
}

/** A number field under its label. */
export function numberField(label, value, unit, whenChanged, { step = "any", min = undefined } = {}) {
  const input = element("input", { type: "number", value, step });
  if (min !== undefined) input.min = min;
  input.addEventListener("input", () => Number.isFinite(input.valueAsNumber) && whenChanged(input.valueAsNumber));
  return element("label", { className: "slider" }, label, input, element("span", { className: "soft" }, unit));
}
