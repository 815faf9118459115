// What is chosen, and what follows from it.

const byId = (id) => document.getElementById(id);
const drawable = Object.keys(collection.surfaces).length + Object.keys(collection.explained).length > 0;
const pair = drawable ? new Pair(byId("left"), byId("right")) : null;

function choose(query, object) {
  if (!placeOfQuery.has(query)) {
    byId("rankings-note").textContent = `The ranking of ${titled(query)} is not on this page.`;
    return;
  }
  const shown = object === undefined || object === query ? rankingOf(query)[0].object : object;
  const focused = document.activeElement && document.activeElement.dataset.object;
  byId("query").value = query;
  byId("rankings-note").textContent = note;
  fillRow(byId("row"), query, shown, choose);
  // The tiles are new ones: the keyboard stays where it was.
  if (focused !== undefined) byId("row").querySelector(`[data-object="${focused}"]`)?.focus();
  if (pair) pair.show(query, shown);
}

const explainedCount = Object.keys(collection.explained).length;
const note = !pair ? "" : explainedCount && explainedCount < queries.length
  ? "Queries marked ◆ have matched parts on this page." : "Choose an object to see it beside the query.";

document.body.classList.toggle("unlabelled", !labelled);
byId("pair").hidden = !pair;
document.querySelector('nav [href="#pair"]').hidden = !pair;
byId("low").textContent = `${short(collection.matrix.low)} similar`;
byId("high").textContent = `${short(collection.matrix.high)} different`;
drawLegend(byId("legend"));
const matrix = new Matrix(byId("matrix-view"), byId("matrix-cell"), choose);
byId("zoom-in").addEventListener("click", () => matrix.zoom(1.5));
byId("zoom-out").addEventListener("click", () => matrix.zoom(1 / 1.5));
byId("zoom-all").addEventListener("click", () => { matrix.all(); matrix.draw(); });
fillQueries(byId("query"));
byId("query").addEventListener("change", (event) => choose(Number(event.target.value)));
choose(queries.find((query) => collection.explained[query]) ?? queries[0]);
