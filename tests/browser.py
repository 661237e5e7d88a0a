"""A real browser for pages: headless Chromium, driven by Selenium, without a network."""

import os
import shutil

import pytest
from selenium import webdriver
from selenium.webdriver import ActionChains
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
DRIVER = shutil.which("chromedriver")

NEEDED = pytest.mark.skipif(
    not (CHROMIUM and DRIVER) and not os.environ.get("CI"),
    reason="needs the browser Chromium and chromedriver (with CI set it must be there)",
)

OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--enable-unsafe-swiftshader",  # draws without a graphics card
    "--hide-scrollbars",
    "--user-agent=test",
    # no calls home
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
SLOW_CARD = "GPU stall due to ReadPixels"  # said about screenshots


class Tab:
    """A page of the browser and what is asked of it."""

    def __init__(self, driver, path, size):
        self.driver = driver
        self.resize(*size)
        driver.get(path.as_uri())

    def script(self, code):
        return self.driver.execute_script(code)

    def resize(self, width, height):
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)

    def prefer(self, what, value):
        feature = {"name": f"prefers-{what}", "value": value}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def one(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def click(self, selector):
        self.script(f"document.querySelector({selector!r}).scrollIntoView()")
        self.one(selector).click()

    def press(self, *keys):
        ActionChains(self.driver).send_keys(*keys).perform()

    def problems(self):
        return [
            entry for entry in self.driver.get_log("browser") if SLOW_CARD not in entry["message"]
        ]


def chrome(profile):
    """Start the browser with a folder of its own."""
    assert CHROMIUM, "CI needs Chromium"
    assert DRIVER, "CI needs chromedriver"
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for option in (*OPTIONS, f"--user-data-dir={profile}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    return webdriver.Chrome(options=options, service=Service(DRIVER))
