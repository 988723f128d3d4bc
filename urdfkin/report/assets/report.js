// The page's behaviour: theme, sorting, filtering, folding, copying. Everything is readable without it.
"use strict";
(() => {
  const $ = (query, root = document) => root.querySelector(query);
  const $$ = (query, root = document) => [...root.querySelectorAll(query)];
  const root = document.documentElement;

  // -- theme: as the system, light, dark ---------------------------------------------------------------
  const THEMES = { "": "as the system", light: "light", dark: "dark" };
  const remember = (value) => { try { localStorage.setItem("urdfkin-theme", value); } catch { /* a file may not */ } };
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

  // -- paper folds nothing: what is folded of an open robot is opened, and folded again ------------
  let opened = [];
  addEventListener("beforeprint", () => {
    opened = $$("details.robot[open] details.fold:not([open])");
    for (const details of opened) details.open = true;
  });
  addEventListener("afterprint", () => { for (const details of opened) details.open = false; });

  // -- tables sort by the head that is pressed ---------------------------------------------------------
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

  // -- the overview filters ----------------------------------------------------------------------------
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
    // The details lie in a file: the page scrolls to them when they are loaded.
    const loaded = (event) => {
      if (event.detail !== robot) return;
      document.removeEventListener("robotloaded", loaded);
      show();
    };
    document.addEventListener("robotloaded", loaded);
  };
  addEventListener("hashchange", goTo);
  document.addEventListener("click", (event) => {
    // The same link pressed twice changes no hash.
    if (event.target.closest?.("#overview a, .verdict a")) setTimeout(goTo);
  });
  goTo();

  // -- Denavit-Hartenberg tables: the chain and the convention are chosen once for view and table ---------
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

  // -- details that lie in a file beside the page: loaded when a robot is unfolded --------------------------
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
    $(".body", robot).innerHTML = details;  // made by the same template as the page, every name escaped
    connect(robot);
    document.dispatchEvent(new CustomEvent("robotloaded", { detail: robot }));
  };
  const load = (robot) => {
    if (!robot.open || robot.dataset.asked) return;
    robot.dataset.asked = "yes";
    waiting.set(Number(robot.id.slice("robot-".length)), robot);
    const script = Object.assign(document.createElement("script"), { src: robot.dataset.file });
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
