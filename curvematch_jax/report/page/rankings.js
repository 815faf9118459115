// The queries as a list, and the ranking of the chosen one as tiles.

function fillQueries(select) {
  const groups = new Map();
  for (const query of queries) {
    const group = labelled ? className(query) : "";
    if (!groups.has(group)) groups.set(group, []);
    groups.get(group).push(query);
  }
  const some = Object.keys(collection.explained).length < queries.length;
  for (const [group, members] of groups) {
    const parent = labelled ? select.appendChild(document.createElement("optgroup")) : select;
    if (labelled) parent.label = group;
    for (const query of members) {
      const marked = some && collection.explained[query] ? " ◆" : "";
      parent.append(new Option(names[query] + marked, query));
    }
  }
}

function fillRow(list, query, object, choose) {
  list.replaceChildren(...rankingOf(query).map(({ object: j, value }, k) => {
    const item = document.createElement("li");
    item.append(tile(query, j, k + 1, value, j === object, () => choose(query, j)));
    return item;
  }));
}

function tile(query, j, rank, value, chosen, act) {
  const button = document.createElement("button"), same = classOf[j] === classOf[query];
  button.type = "button";
  button.className = !labelled || same ? "tile" : "tile other";
  button.setAttribute("aria-pressed", chosen);
  button.dataset.object = j;
  button.addEventListener("click", act);
  const surface = surfaceOf(j);
  if (surface) {
    const canvas = document.createElement("canvas");
    canvas.setAttribute("aria-hidden", "true");
    thumbnail(canvas, surface);
    button.append(canvas);
  }
  const name = document.createElement("b"), lines = [`dissimilarity ${short(value)}`];
  name.textContent = `${rank}. ${names[j]}`;
  if (labelled) lines.push(same ? "✓ same class" : `✗ ${className(j)}`);
  button.append(name, ...lines.map((line) => Object.assign(document.createElement("span"), { textContent: line })));
  return button;
}
