// Runs a page's script on a document that has as much of a browser as the script needs: its first argument is
// JSON with the script, the data of the film and of the cursor, the times of the items, and what the user does.
const { script, film: filmData, cursor: cursorData, items, steps } = JSON.parse(process.argv[2]);

class Item {
  constructor(dataset = {}, inSvg = null) {
    Object.assign(this, { dataset, inSvg, attributes: {}, listeners: {} });
  }
  setAttribute(name, value) { this.attributes[name] = value; }
  removeAttribute(name) { delete this.attributes[name]; }
  addEventListener(kind, handler) { this.listeners[kind] = handler; }
  closest(selector) {
    return selector === "svg" ? this.inSvg : "time" in this.dataset ? this : null;
  }
}

const svg = new Item();
const film = new Item(filmData);
Object.assign(film, { currentTime: 0, paused: true, ended: false, scrollIntoView() {} });
const cursor = new Item(cursorData);
cursor.attributes.display = "none";
const elements = items.map((time, index) => new Item(time === null ? {} : { time }, index % 2 ? svg : null));
const form = new Item();
form.querySelectorAll = () => [];
form.elements = { skill: { value: "" }, words: { value: "" } };
const known = { film, cursor, form, filter: form, shown: {} };
const page = new Item();
page.getElementById = (id) => known[id];
page.querySelectorAll = (selector) =>
  selector === "[data-time]" ? elements.filter((one) => "time" in one.dataset) : [];
const frames = [];

new Function("document", "requestAnimationFrame", script)(page, (next) => frames.push(next));

const seen = steps.map(([kind, value, key]) => {
  let prevented = false;
  if (kind === "click" || kind === "keydown") {
    const event = { type: kind, key, target: elements[value], preventDefault() { prevented = true; } };
    page.listeners[kind](event);
    film.listeners.seeking();
  } else if (kind === "play") {
    film.paused = false;
    film.listeners.play();
  } else if (kind === "frame") {
    film.currentTime = value;
    frames.shift()();
  } else {
    film.paused = true;
    frames.shift()();
  }
  return { time: film.currentTime, cursor: cursor.attributes.transform, waiting: frames.length, prevented };
});
console.log(JSON.stringify({
  seen,
  display: cursor.attributes.display ?? null,
  items: elements.map((one) => one.attributes),
  titles: elements.map((one) => one.title ?? null),
  svg: svg.attributes,
}));
