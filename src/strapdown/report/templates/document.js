"use strict";
// Draws each chart over its picture, which stays where drawing fails and on paper.
(function () {
  var still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;

  function control(box, names, plot) {
    var button = box.querySelector("button");
    var slider = box.querySelector("input");
    var shown = box.querySelector("output");
    var timer = null;
    slider.max = names.length - 1;
    function show(k) {
      slider.value = k;
      shown.textContent = names[k];
      slider.setAttribute("aria-valuetext", names[k]);
      Plotly.animate(plot, [String(k)], {
        mode: "immediate",
        transition: {duration: 0},
        frame: {duration: 0, redraw: true}
      });
    }
    function stop() {
      window.clearInterval(timer);
      timer = null;
      button.textContent = "Play";
    }
    button.addEventListener("click", function () {
      if (timer !== null) { stop(); return; }
      if (+slider.value >= names.length - 1) { show(0); }
      button.textContent = "Pause";
      timer = window.setInterval(function () {
        if (+slider.value >= names.length - 1) { stop(); } else { show(+slider.value + 1); }
      }, +box.dataset.interval);
    });
    slider.addEventListener("input", function () { stop(); show(+slider.value); });
    button.hidden = still;
    box.querySelector(".controls").hidden = false;
    show(0);
  }

  document.querySelectorAll("script[type='application/json']").forEach(function (source) {
    var box = document.getElementById(source.dataset.target);
    var plot = box.querySelector(".plot");
    var figure = JSON.parse(source.textContent);
    var names = (figure.frames || []).map(function (frame, k) {
      return String(frame.name === undefined ? k + 1 : frame.name);
    });
    // Names need not differ; numbers do.
    (figure.frames || []).forEach(function (frame, k) { frame.name = String(k); });
    figure.config = {responsive: true, displayModeBar: false, showTips: false};
    box.classList.add("live");
    try {
      Plotly.newPlot(plot, figure).then(function () {
        if (names.length) { control(box, names, plot); }
      });
    } catch (error) {
      box.classList.remove("live");
    }
  });
})();
