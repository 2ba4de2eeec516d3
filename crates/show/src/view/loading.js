// How much of the data has come, while the browser still reads the page; data.js goes on with the bar.
"use strict";

const loading = { share: 0 };

/** Shows that this share of the work is done until the page can be used; reading the page is its first half. */
function showLoading(share, words) {
  loading.share = share;
  document.getElementById("progress").value = share;
  document.getElementById("progressText").textContent = words;
}

/** Looks how much of the data has come so far. */
function watchLoading() {
  const facts = document.getElementById("facts")?.nextElementSibling && JSON.parse(document.getElementById("facts").textContent);
  const all = facts?.bytes ?? 0;
  const look = () => {
    if (!all) return loading.timer = setTimeout(watchLoading, 100);
    let bytes = 0;
    for (const element of document.querySelectorAll("script[data-size]")) {
      // what has come of an element stands in several texts
      if (element.nextElementSibling) bytes += Number(element.dataset.size);
      else for (const text of element.childNodes) bytes += text.length;
    }
    const megabytes = (number) => (number / 1e6).toFixed(number < 1e7 ? 1 : 0);
    showLoading((0.5 * Math.min(bytes, all)) / all, `loading ${megabytes(bytes)} of ${megabytes(all)} MB`);
    loading.timer = setTimeout(look, 100);
  };
  look();
}

watchLoading();
