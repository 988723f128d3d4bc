// Functions that the browser tests call in a page.
window.probe = {
  // Return the number of drawn pixels of the first view, a checksum of the pixels, and the number of all pixels.
  pixels() {
    const canvas = document.querySelector("canvas"), { width, height } = canvas;
    const data = canvas.getContext("2d").getImageData(0, 0, width, height).data;
    let drawn = 0, sum = 0;
    for (let i = 3; i < data.length; i += 4) {
      if (!data[i]) continue;
      drawn += 1;
      sum = (sum + i * (data[i - 3] + data[i - 2] + data[i - 1])) % 1e12;
    }
    return [drawn, sum, width * height];
  },

  // Return the number of pixels of joints (blue) and of links (grey).
  colours() {
    const canvas = document.querySelector("canvas");
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    let blue = 0, grey = 0;
    for (let i = 0; i < data.length; i += 4) {
      if (data[i + 3] < 200) continue;
      if (data[i + 2] > data[i] + 60) blue += 1;
      else if (Math.abs(data[i] - data[i + 2]) < 40) grey += 1;
    }
    return [blue, grey];
  },

  slide(index, value) {
    const slider = document.querySelectorAll(".sliders input")[index];
    slider.value = value;
    slider.dispatchEvent(new Event("input"));
    return document.querySelectorAll(".sliders output")[index].textContent;
  },

  press(key) {
    const canvas = document.querySelector("canvas");
    canvas.focus();
    canvas.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  },

  showTable(convention) {
    const view = document.querySelector(".view"), box = view.querySelector("[data-show=dh]");
    box.checked = true;
    box.dispatchEvent(new Event("change"));
    const choice = view.querySelector("select[data-convention]");
    choice.value = convention;
    choice.dispatchEvent(new Event("change"));
  },
  visibleTables() {
    const tables = [...document.querySelectorAll("#robot-0 .chain:not([hidden]) table")];
    return tables.filter((table) => table.checkVisibility()).map((table) => table.caption.textContent.split(" ")[0]);
  },

  // Return the tip poses of the first chain in the first view for a configuration: links, standard and modified table.
  chainEnds(q) {
    const { robot } = document.querySelector("[data-view]").view, chain = robot.chains[0];
    robot.q = q;
    robot.move();
    const rows = (T) => T.clone().transpose().toArray();
    const ends = [rows(robot.poses[chain.tip])];
    for (const convention of ["standard", "modified"]) ends.push(rows(robot.dh(chain, convention).tip));
    return ends;
  },

  heads: () => [...document.querySelectorAll("#overview thead th")].map((head) => head.textContent),
  column: (index) => [...document.querySelectorAll("#overview tbody tr")].map((row) => row.cells[index].textContent),
  sortBy(index) {
    document.querySelectorAll("#overview thead button")[index].click();
    return document.querySelectorAll("#overview thead th")[index].ariaSort;
  },
  find(words) {
    const input = document.querySelector("#find");
    input.value = words;
    input.dispatchEvent(new Event("input"));
    const hidden = [...document.querySelectorAll("details.robot")].map((robot) => robot.hidden);
    return [document.querySelector("#shown").textContent, hidden];
  },
  unfoldAll: () => document.querySelectorAll("details").forEach((part) => { part.open = true; }),
};
