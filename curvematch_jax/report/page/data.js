"use strict";

// The collection as it was written: numbers are base64 of little-endian arrays.
const collection = JSON.parse(document.getElementById("data").textContent);

function bytes(text) {
  const raw = atob(text), values = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) values[i] = raw.charCodeAt(i);
  return values;
}

// Read byte by byte, so that the machine's own order of bytes does not matter.
function numbers(text, kind) {
  const view = new DataView(bytes(text).buffer);
  const size = { u2: 2, u4: 4, f4: 4 }[kind];
  const read = { u2: "getUint16", u4: "getUint32", f4: "getFloat32" }[kind];
  return Array.from({ length: view.byteLength / size }, (_, i) => view[read](i * size, true));
}

const names = collection.names;
const order = numbers(collection.order, "u4");
const classOf = numbers(collection.classOf, "u4");
const queries = numbers(collection.rankings.queries, "u4");
const ranked = numbers(collection.rankings.ranked, "u4");
const dissimilarities = numbers(collection.rankings.values, "f4");
const placeOfQuery = new Map(queries.map((query, place) => [query, place]));
const labelled = collection.classes.length > 0;

const className = (j) => collection.classes[classOf[j]];
const titled = (j) => (labelled ? `${names[j]} (${className(j)})` : names[j]);
const short = (value) => String(Number(value.toPrecision(3)));

// The ranking of a query: objects and their dissimilarities.
function rankingOf(query) {
  const count = collection.rankings.count, start = placeOfQuery.get(query) * count;
  return ranked.slice(start, start + count).map((object, k) => ({ object, value: dissimilarities[start + k] }));
}

// What is known of a pair, or nothing.
function pairOf(query, object) {
  const of = collection.explained[query];
  return of && of.objects[object] ? { ...of.objects[object], ignorance: of.ignorance, conflict: of.conflict, open: of.open } : null;
}

const grey = collection.palette.length - 1;
const colours = collection.palette.map((text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16)));
const colourOf = (part) => colours[part < 0 ? grey : part % grey];
const css = (colour) => `rgb(${colour.join(",")})`;
// Black or white, whichever is read more easily on a colour (relative luminance of WCAG 2).
function inkOn(colour) {
  const [r, g, b] = colour.map((v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.179 ? "#000" : "#fff";
}
