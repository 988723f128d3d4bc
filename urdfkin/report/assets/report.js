// Behaviour of the page: theme, sorting, filtering, folding, copying. Without this script, all text is visible.
"use strict";
(() => {
  const $ = (query, root = document) => root.querySelector(query);
  const $$ = (query, root = document) => [...root.querySelectorAll(query)];
  const root = document.documentElement;

  // -- theme -------------------------------------------------------------------------------------------
  const THEMES = { "": "as the system", light: "light", dark: "dark" };
  const remember = (value) => { try { localStorage.setItem("urdfkin-theme", value); } catch { /* a page from a file may have no storage */ } };
  const recall = () => { try { return localStorage.getItem("urdfkin-theme") || ""; } catch { return ""; } };
  const setTheme = (theme) => {
    if (theme) root.dataset.theme = theme; else delete root.dataset.theme;
    $("#theme").textContent = `Theme: ${THEMES[theme]}`;
    document.dispatchEvent(new Event("themechange"));
  };
  setTheme(recall() in THEMES ? recall() : "");
  $("#theme").addEventListener("click", () => {
    const order = Object.keys(THEMES);
    const next = order[(order.indexOf(root.dataset.theme || "") + 1) % order.length];
    remember(next);
    setTheme(next);
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => document.dispatchEvent(new Event("themechange")));

  // -- printing: folded sections of an open robot are unfolded, and folded again afterwards ------------
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = $$("details.robot[open] details.fold:not([open])");
    for (const details of opened) details.open = true;
  });
  addEventListener("afterprint", () => { for (const details of opened) details.open = false; });

  // -- sorting: a click on a heading sorts the table by this column -------------------------------------
  const key = (row, column, isText) => {
    const cell = row.cells[column];
    if (isText) return cell.textContent.trim().toLowerCase();
    const words = cell.dataset.key ?? cell.textContent.replace(/[,%✗]/g, "");
    const number = words.trim() === "inf" ? Infinity : parseFloat(words);
    return Number.isNaN(number) ? -Infinity : number;
  };
  const sort = (table, column) => {
    const head = table.tHead.rows[0].cells[column], isText = "text" in head.dataset || column === 0;
    const down = head.ariaSort ? head.ariaSort === "ascending" : !isText;
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    head.ariaSort = down ? "descending" : "ascending";
    const compare = isText ? (a, b) => a.localeCompare(b, "en", { numeric: true }) : (a, b) => (a < b ? -1 : a > b ? 1 : 0);
    const rows = [...table.tBodies[0].rows].map((row, i) => [key(row, column, isText), i, row]);
    rows.sort((a, b) => (down ? compare(b[0], a[0]) : compare(a[0], b[0])) || a[1] - b[1]);
    table.tBodies[0].append(...rows.map((entry) => entry[2]));
  };
  document.addEventListener("click", (event) => {
    const head = event.target.closest?.("table.sortable > thead th");
    if (head) sort(head.closest("table"), head.cellIndex);
  });

  // -- filtering the overview ---------------------------------------------------------------------------
  const find = $("#find"), verdict = $("#verdict");
  const filter = () => {
    const words = find.value.trim().toLowerCase();
    const fits = (name, own) => name.toLowerCase().includes(words) && (!verdict.value || own === verdict.value);
    const rows = $$("#overview tbody tr");
    for (const row of rows) row.hidden = !fits(row.cells[0].textContent, row.dataset.verdict);
    for (const robot of $$("details.robot")) robot.hidden = !fits(robot.dataset.name, robot.dataset.verdict);
    $("#shown").textContent = `${rows.filter((row) => !row.hidden).length} of ${rows.length}`;
  };
  if (find) {
    find.addEventListener("input", filter);
    verdict.addEventListener("change", filter);
  }

  // -- folding -----------------------------------------------------------------------------------------
  const setAll = (open) => $$("details.robot").forEach((robot) => { if (!robot.hidden) robot.open = open; });
  $("#unfold")?.addEventListener("click", () => setAll(true));
  $("#fold")?.addEventListener("click", () => setAll(false));
  const goTo = () => {
    const part = location.hash.slice(1), robot = document.getElementById(part.replace(/-findings$/, ""));
    if (!robot?.matches("details.robot")) return;
    const show = () => {
      const target = document.getElementById(part) ?? robot;
      target.open = true;
      target.scrollIntoView();
    };
    robot.open = true;
    show();
    if (document.getElementById(part)) return;
    // The details are in a file; the page scrolls to the details when the file is loaded.
    const loaded = (event) => {
      if (event.detail !== robot) return;
      document.removeEventListener("robotloaded", loaded);
      show();
    };
    document.addEventListener("robotloaded", loaded);
  };
  addEventListener("hashchange", goTo);
  document.addEventListener("click", (event) => {
    // A second click on a link does not change the hash of the page, so there is no event "hashchange".
    if (event.target.closest?.("#overview a, .verdict a")) setTimeout(goTo);
  });
  goTo();

  // -- Denavit-Hartenberg tables: the selected chain and convention apply to the 3D view and the tables -----
  const connect = (robot) => {
    const chains = $$(".chain", robot), chain = $("select[data-chain]", robot), convention = $("select[data-convention]", robot);
    if (!chain) return;
    const show = () => chains.forEach((part) => { part.hidden = part.dataset.chain !== chain.value; });
    const radios = $$(".switch input", robot);
    chain.addEventListener("change", show);
    convention.addEventListener("change", () => radios.forEach((radio) => { radio.checked = radio.value === convention.value; }));
    radios.forEach((radio) => radio.addEventListener("change", () => {
      convention.value = radio.value;
      convention.dispatchEvent(new Event("change"));
    }));
    show();
  };
  $$("details.robot").forEach(connect);

  // -- details in a file beside the page: loaded when the reader unfolds the robot ---------------------------
  const waiting = new Map();
  const missing = (robot, why) => {
    $(".body", robot).innerHTML = '<p class="reason" role="note"></p>';
    $(".reason", robot).textContent = `The details cannot be shown: the file ${robot.dataset.file} beside this page ${why}.`;
  };
  globalThis.urdfkinRobot = ([token, index, details]) => {
    const robot = waiting.get(index);
    if (!robot) return;
    waiting.delete(index);
    if (token !== root.dataset.token) return void missing(robot, "belongs to another report");
    $(".body", robot).innerHTML = details;  // from the template of the page, which escapes every name
    connect(robot);
    document.dispatchEvent(new CustomEvent("robotloaded", { detail: robot }));
  };
  const load = (robot) => {
    if (!robot.open || robot.dataset.asked) return;
    robot.dataset.asked = "yes";
    waiting.set(Number(robot.id.slice("robot-".length)), robot);
    // The name of the page may contain #, ? or %.
    const src = robot.dataset.file.split("/").map(encodeURIComponent).join("/");
    const script = Object.assign(document.createElement("script"), { src });
    script.addEventListener("error", () => { delete robot.dataset.asked; missing(robot, "is not there"); });
    script.addEventListener("load", () => script.remove());
    document.head.append(script);
  };
  for (const robot of $$("details.robot[data-file]")) {
    robot.addEventListener("toggle", () => load(robot));
    load(robot);
  }

  // -- copying -----------------------------------------------------------------------------------------
  const copy = async (text) => {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const area = Object.assign(document.createElement("textarea"), { value: text });
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
  };
  document.addEventListener("click", async (event) => {
    const button = event.target.closest?.("[data-copy]");
    if (!button) return;
    await copy(button.parentElement.querySelector("code").textContent);
    button.textContent = "Copied";
    setTimeout(() => { button.textContent = "Copy"; }, 1500);
  });
})();
