"""Checks reports in a real browser for missing or empty figures, invalid numbers, and cut text.

    browser.py [--screenshots DIR] [--figures ID,ID,…] REPORT.html…

The script needs the Python standard library and Chromium. It adds a probe to a copy of each page. The probe examines the rendered page and
writes its result into the page, and the browser then prints the page.
"""

import argparse
import base64
import hashlib
import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

# Probe for visible faults: figures without extent, invalid coordinates, text outside its drawing or over another text, a page wider than
# the screen, and downloads.
PROBE = """
<script>
addEventListener("load", async () => {
  const faults = [];
  const near = (svg, element) => {
    const box = element.getBoundingClientRect(), own = svg.getBoundingClientRect();
    return {left: box.left - own.left, top: box.top - own.top, right: box.right - own.left, bottom: box.bottom - own.top,
            width: own.width, height: own.height, text: element.textContent.trim()};
  };
  // One state is visible at a time, and the slider selects it.
  for (const states of document.querySelectorAll("details.states")) {
    const seen = () => [...states.querySelectorAll(".state")].map((state) => !state.hidden);
    const slider = states.querySelector("input");
    if (seen().indexOf(true) !== seen().length - 1) faults.push("the slider does not start at the last state");
    slider.value = 0;
    slider.dispatchEvent(new Event("input"));
    if (seen().indexOf(true) !== 0 || seen().lastIndexOf(true) !== 0) faults.push("the slider does not select a state");
    states.querySelectorAll(".state").forEach((state) => (state.hidden = false));
  }
  // Dragging enlarges a chart and changes the numbers at its axes. A double click restores the chart. A name in the legend hides its curve.
  const chart = document.querySelector("svg.plot");
  if (chart) {
    const numbers = () => [...chart.parentNode.querySelectorAll("[data-ticks] text")].map((text) => text.textContent).join();
    const point = (part) => {
      const box = chart.getBoundingClientRect();
      return {bubbles: true, button: 0, pointerType: "mouse", clientX: box.left + part * box.width, clientY: box.top + part * box.height};
    };
    const before = numbers();
    chart.dispatchEvent(new PointerEvent("pointerdown", point(0.4)));
    chart.dispatchEvent(new PointerEvent("pointerup", point(0.6)));
    if (numbers() === before) faults.push("dragging does not enlarge a chart");
    chart.dispatchEvent(new MouseEvent("dblclick", {bubbles: true}));
    const back = chart.parentNode.querySelectorAll("[data-ticks] text").length;
    if (!back) faults.push("no numbers at the axes after a double click");
  }
  const key = document.querySelector(".key");
  if (key) {
    const hidden = () => key.parentNode.querySelectorAll("svg.plot .off").length;
    key.dispatchEvent(new MouseEvent("click", {bubbles: true}));
    if (!hidden()) faults.push("the legend hides no curve");
    key.dispatchEvent(new MouseEvent("click", {bubbles: true}));
    if (hidden()) faults.push("the legend does not show a hidden curve again");
  }
  const figures = [...document.querySelectorAll("figure")];
  for (const figure of figures) {
    const say = (what) => faults.push(`${figure.id}: ${what}`);
    if (!figure.querySelector("figcaption p")?.textContent.trim()) say("the caption is missing");
    const drawings = [...figure.querySelectorAll("svg:not(.plot)")];
    if (!drawings.length) say("the drawing is missing");
    for (const svg of drawings) {
      const box = svg.getBBox();
      if (!(box.width > 0 && box.height > 0)) say("a drawing is empty");
      if (!svg.querySelector("title")?.textContent.trim()) say("a drawing has no title");
      if (!svg.querySelector("polyline, image, rect, circle")) say("a drawing has no marks");
      for (const element of svg.querySelectorAll("*"))
        for (const attribute of element.attributes)
          if (/\b(NaN|inf|infinity|undefined)\b/i.test(attribute.value) && !attribute.value.startsWith("data:"))
            say(`${element.tagName} ${attribute.name}="${attribute.value.slice(0, 60)}"`);
      const texts = [...svg.querySelectorAll("text")].filter((text) => text.textContent.trim()).map((text) => near(svg, text));
      for (const text of texts)
        if (text.left < -1 || text.top < -1 || text.right > text.width + 1 || text.bottom > text.height + 1)
          say(`"${text.text}" is cut off`);
      texts.forEach((a, k) => texts.slice(k + 1).forEach((b) => {
        const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        // The boxes of text lines include space above and below the letters.
        if (wide > 1 && high > 0.35 * Math.min(a.bottom - a.top, b.bottom - b.top))
          say(`"${a.text}" overlaps "${b.text}"`);
      }));
    }
  }
  for (const image of document.querySelectorAll("image"))
    if (!image.getAttribute("href").startsWith("data:image/png;base64,")) faults.push("an image is not stored in the page");
  const wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
  if (wide > 0) faults.push(`the page is ${wide} px wider than the screen`);
  for (const link of document.querySelectorAll("nav a"))
    if (!document.querySelector(link.getAttribute("href"))) faults.push(`a link has no target: ${link.getAttribute("href")}`);
  const elsewhere = performance.getEntriesByType("resource").map((entry) => entry.name);
  for (const name of elsewhere.filter((name) => !name.startsWith("data:"))) faults.push(`the page downloads ${name}`);
  // The page shows the value of a curve at the pointer.
  const within = (axis, place) => {
    const [begin, end] = axis.split(" ").map(Number);
    return (place - begin) * (place - end) <= 0;
  };
  const lines = [...document.querySelectorAll("svg[data-x] polyline[class^=s]")];
  const corners = lines.flatMap((line) =>
    line.getAttribute("points").trim().split(/\s+/).map((corner) => [line, ...corner.split(",").map(Number)]));
  // Marks of the legend lie outside the axes.
  const inside = ([line, x, y]) => within(line.closest("svg").dataset.x, x) && within(line.closest("svg").dataset.y, y);
  const first = corners.find(inside);
  if (lines.length && !first) faults.push("no curve within the axes");
  if (first) {
    const [line, x, y] = first;
    line.scrollIntoView();
    const point = new DOMPoint(x, y).matrixTransform(line.getScreenCTM());
    line.dispatchEvent(new PointerEvent("pointermove", {bubbles: true, clientX: point.x, clientY: point.y}));
    await new Promise((ready) => setTimeout(ready, 50));
    const tip = document.querySelector("#tip");
    if (tip?.hidden !== false || !/\d/.test(tip.textContent)) faults.push("no value at the pointer");
    if (tip) tip.hidden = true;
  }
  const found = {
    figures: figures.map((figure) => figure.id.replace(/^fig-/, "")),
    faults,
    width: innerWidth,
    height: document.documentElement.scrollHeight,
    dark: matchMedia("(prefers-color-scheme: dark)").matches,
    background: getComputedStyle(document.body).backgroundColor,
    ink: getComputedStyle(document.body).color,
  };
  const result = document.createElement("script");
  result.type = "application/json";
  result.id = "found";
  result.textContent = JSON.stringify(found);
  document.body.append(result);
});
</script>
"""

# Colour schemes as Chromium numbers them.
DARK, LIGHT = 0, 1
VIEWS = {"light": (1200, LIGHT), "dark": (1200, DARK), "narrow": (390, LIGHT)}


def chromium():
    for name in ("chromium", "chromium-browser", "google-chrome", "chrome"):
        if path := shutil.which(name):
            return path
    sys.exit("Chromium is missing; install the Debian package chromium")


def open_in_browser(browser, page, size, scheme, folder, *arguments):
    """Output of the browser on stdout and on stderr."""
    command = [
        browser,
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-extensions",
        "--hide-scrollbars",
        "--enable-logging=stderr",
        "--virtual-time-budget=10000",
        f"--blink-settings=preferredColorScheme={scheme}",
        f"--user-data-dir={folder}/profile",
        f"--window-size={size[0]},{size[1]}",
        *arguments,
        page.resolve().as_uri(),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    return done.stdout, done.stderr


def framed(folder, page, width, height):
    """Page with another page in a frame of the width of a telephone. Windows of the browser cannot be that narrow."""
    frame = folder / f"frame_{page.stem}.html"
    style = f"border:0;width:{width}px;height:{height}px"
    frame.write_text(f'<!DOCTYPE html><body style="margin:0"><iframe src="{page.name}" style="{style}"></iframe>', encoding="utf-8")
    return frame


def check(browser, report, expected, screenshots):
    faults = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        text = report.read_text(encoding="utf-8")
        if re.search(r"""(?:src|href)=["'](?:https?:)?//""", text):
            faults.append("the page refers to a network address")
        # The policy of the page allows only the page's script. The copy also allows the probe.
        own = re.search(r"script-src '(sha256-[^']+)'", text)
        script = re.search(r"<script>(.*)</script>", text, re.DOTALL)
        if not own or not script:
            return ["the script of the page or the policy for the script is missing"]
        if own[1] != "sha256-" + base64.b64encode(hashlib.sha256(script[1].encode()).digest()).decode():
            faults.append("the policy of the page refuses its own script")
        probed = text.replace(f"'{own[1]}'", "'unsafe-inline'").replace("default-src 'none'", "default-src 'none'; frame-src *")
        # In a frame, the probe writes its result into the outer page.
        probe = PROBE.replace("document.body.append(result)", "(parent === window ? document : parent.document).body.append(result)")
        page = folder / "page.html"
        page.write_text(probed.replace("</body>", probe + "</body>"), encoding="utf-8")
        for view, (width, scheme) in VIEWS.items():
            narrow = width < 500
            opened = framed(folder, page, width, 900) if narrow else page
            out, log = open_in_browser(
                browser, opened, (max(width, 500), 900), scheme, folder, "--allow-file-access-from-files", "--dump-dom"
            )
            console = [line for line in log.splitlines() if "CONSOLE" in line]
            faults += [f"{view}: console: {line}" for line in console]
            match = re.search(r'<script type="application/json" id="found">(.*?)</script>', out, re.DOTALL)
            if not match:
                faults.append(f"{view}: the page did not load: {log[-500:]}")
                continue
            found = json.loads(match[1].replace("&quot;", '"').replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&"))
            faults += [f"{view}: {fault}" for fault in found["faults"]]
            faults += [f"{view}: figure {figure} is missing" for figure in expected if figure not in found["figures"]]
            if found["width"] != width:
                faults.append(f"{view}: the page is {found['width']} px wide instead of {width} px")
            if found["dark"] != (scheme == DARK):
                faults.append(f"{view}: the browser uses another colour scheme")
            if (sum(map(int, re.findall(r"\d+", found["background"])[:3])) < 200) != (scheme == DARK):
                faults.append(f"{view}: the background is {found['background']}")
            if screenshots:
                target = screenshots / f"{report.stem}_{view}.png"
                plain = folder / "plain.html"
                plain.write_text(text, encoding="utf-8")
                height = found["height"] + 20
                shown = framed(folder, plain, width, height) if narrow else plain
                open_in_browser(
                    browser, shown, (max(width, 500), height), scheme, folder, f"--screenshot={target.resolve()}"
                )
                if not target.is_file():
                    faults.append(f"{view}: the screenshot is missing")
            print(f"{report} {view}: {len(found['figures'])} figures, {len(found['faults'])} faults")
    return faults


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("reports", nargs="+", type=Path)
    parser.add_argument("--figures", default="", help="required figures, separated by commas")
    parser.add_argument("--screenshots", type=Path, help="folder for screenshots of the pages")
    arguments = parser.parse_args()
    if arguments.screenshots:
        arguments.screenshots.mkdir(parents=True, exist_ok=True)
    expected = [name for name in arguments.figures.split(",") if name]
    browser = chromium()
    faults = []
    for report in arguments.reports:
        faults += [f"{report}: {fault}" for fault in check(browser, report, expected, arguments.screenshots)]
    for fault in faults:
        print(fault, file=sys.stderr)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
