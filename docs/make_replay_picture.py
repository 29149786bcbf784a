"""Draws the picture at the top of the README: the replay of one trial, by a headless Chromium.

clearway run hospital --robot tiago --navigator hp-st --batch CE --speed 0.6 --size 0.30 --repetitions 1 --out results/picture
python docs/make_replay_picture.py results/picture 0
"""

import sys
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.common.by import By

import clearway
from clearway.reports import write_replay

results, trial = clearway.open_results(sys.argv[1]), int(sys.argv[2])
options = webdriver.ChromeOptions()
for argument in ("--headless", "--no-sandbox", "--hide-scrollbars", "--window-size=1180,1000"):
    options.add_argument(argument)
browser = webdriver.Chrome(options=options)
browser.get(write_replay(results, trial).resolve().as_uri())
browser.execute_script(
    "const s = document.querySelector('#player input[type=range]'); s.value = s.max * 0.42;"
    "s.dispatchEvent(new Event('input'));"
)
picture = Path(__file__).parent / "images" / "replay.png"
picture.write_bytes(browser.find_element(By.CSS_SELECTOR, "#player .row").screenshot_as_png)
browser.quit()
print(picture, f"{picture.stat().st_size / 1000:.0f} kB")
