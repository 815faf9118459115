// A query beside an object: matched parts in the same colours, and what each part believes.

class Pair {
  constructor(left, right) {
    this.left = new View(left);
    this.right = new View(right);
    this.only = null;
  }

  show(query, object) {
    Object.assign(this, { query, object, known: pairOf(query, object), only: null });
    const known = this.known, value = rankingOf(query).find((each) => each.object === object);
    const facts = [`${titled(query)} and ${titled(object)}`];
    if (value) facts.push(`dissimilarity ${short(value.value)}`);
    if (known) facts.push(`probability ${short(known.probability)} after combination, conflict ${short(known.conflict)}, ignorance ${short(known.open)}`);
    else facts.push("its matched parts are not on this page (see About this page)");
    document.getElementById("pair-facts").textContent = `${facts.join("; ")}.`;
    for (const [side, j, role] of [["left", query, "query"], ["right", object, "object"]]) {
      document.getElementById(`${side}-name`).textContent = `${role}: ${titled(j)}` + (surfaceOf(j) ? "" : " (not drawn on this page)");
      document.getElementById(side).setAttribute("aria-label", `${role} ${names[j]}, seen in 3-D`);
    }
    document.getElementById("matches").hidden = !known || !known.matches.length;
    document.querySelector("#matches tbody").replaceChildren(...(known ? known.matches.map((match) => this.line(match)) : []));
    this.draw();
  }

  draw() {
    const { known, query, object } = this, matches = known ? known.matches : [];
    const count = known ? known.ignorance.length : 0;
    const own = Array.from({ length: count }, (_, i) => i);
    this.left.show(surfaceOf(query), own, own.map(String), this.only);
    // With one part chosen, what it matched has its colour, even where another part of the query is nearer.
    const owner = known ? [...known.owner] : [];
    const chosen = matches.find(([part]) => part === this.only);
    if (chosen) owner[chosen[1]] = this.only;
    const labels = owner.map((_, i) => matches.filter(([, other]) => other === i).map(([part]) => part).sort((a, b) => a - b).join(","));
    this.right.show(surfaceOf(object), owner, labels, this.only);
  }

  line([part, other, distance, mass, probability]) {
    const row = document.createElement("tr"), head = document.createElement("th"), number = document.createElement("button");
    head.scope = "row";
    number.type = "button";
    number.className = "number";
    number.textContent = part;
    number.setAttribute("aria-label", `part ${part} alone`);
    number.setAttribute("aria-pressed", "false");
    number.style.background = css(colourOf(part));
    number.style.color = inkOn(colourOf(part));
    number.addEventListener("click", () => this.alone(part));
    head.append(number);
    row.append(head, cell(other), cell(distance.toFixed(3)), bar(mass, this.most()),
      cell(this.known.ignorance[part].toPrecision(3)), cell(probability.toPrecision(3)));
    return row;
  }

  most() { return Math.max(...this.known.matches.map(([, , , mass]) => mass), Number.MIN_VALUE); }

  // One part, or all again.
  alone(part) {
    this.only = this.only === part ? null : part;
    for (const button of document.querySelectorAll("#matches .number"))
      button.setAttribute("aria-pressed", Number(button.textContent) === this.only);
    this.draw();
  }
}

function cell(text) {
  return Object.assign(document.createElement("td"), { textContent: text });
}

// The bars of a pair compare its parts: the longest is that of the most mass.
function bar(mass, most) {
  const td = document.createElement("td"), box = document.createElement("div"), track = document.createElement("div");
  const filled = document.createElement("i");
  box.className = "mass";
  track.className = "track";
  filled.style.width = `${(100 * mass) / most}%`;
  track.append(filled);
  box.append(track, Object.assign(document.createElement("span"), { textContent: mass.toPrecision(3) }));
  td.append(box);
  return td;
}
