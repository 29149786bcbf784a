"""Takes pictures of the tops of pages by a headless Chromium, small enough for the docs.

python docs/make_page_pictures.py hospital=results/hospital rescue=results/sar barn=results/barn people=results/people \
    lab=scored comparison=compared tuning=tuned requirement=results/requirement-door telephone=results/hospital

Each is a results directory with its report, or the folder of a comparison, a tuning or a requirement; `telephone` is drawn 390 px wide, the others 1,400 px.
"""

import base64
import sys
from io import BytesIO
from pathlib import Path

from PIL import Image
from selenium import webdriver

HEIGHT, LARGEST = 1250, 120_000

options = webdriver.ChromeOptions()
for argument in ("--headless", "--no-sandbox", "--hide-scrollbars"):
    options.add_argument(argument)
browser = webdriver.Chrome(options=options)
for given in sys.argv[1:]:
    name, _, folder = given.partition("=")
    page = next(p for p in (Path(folder) / "report" / "index.html", Path(folder) / "index.html") if p.exists())
    width = 390 if name == "telephone" else 1400
    size = {"width": width, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(page.resolve().as_uri())
    taken = base64.b64decode(browser.execute_cdp_cmd("Page.captureScreenshot", {})["data"])
    picture = Path(__file__).parent / "images" / f"page-{name}.png"
    Image.open(BytesIO(taken)).convert("RGB").quantize(128).save(picture, optimize=True)
    print(picture, f"{picture.stat().st_size / 1000:.0f} kB")
    if picture.stat().st_size > LARGEST:
        sys.exit(f"{picture} is larger than {LARGEST} bytes")
browser.quit()
