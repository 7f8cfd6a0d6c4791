"use strict";
// Below each map where the pointer is: metres of the mission frame, and degrees where the mission has an origin.
const series = (name) => (document.body.dataset[name] || "").split(" ").map(Number);
const latitude = series("latitude"), longitude = series("longitude");
const degrees = (terms, x, y, positive, negative) => {
  const value = [1, x, y, x * x, x * y, y * y].reduce((sum, term, index) => sum + term * terms[index], 0);
  const wrapped = ((value + 540) % 360) - 180;
  return `${Math.abs(wrapped).toFixed(6)}° ${wrapped < 0 ? negative : positive}`;
};
for (const map of document.querySelectorAll("svg[data-west]")) {
  const told = document.createElement("p");
  told.className = "pointer";
  const hint = told.textContent = "Coordinates of the place under the pointer";
  map.after(told);
  const tell = (event) => {
    const place = new DOMPoint(event.clientX, event.clientY).matrixTransform(map.getScreenCTM().inverse());
    const x = Number(map.dataset.west) + place.x, y = Number(map.dataset.north) - place.y;
    const metres = `x ${x.toFixed(1)} m, y ${y.toFixed(1)} m`;
    told.textContent = latitude.length < 6 ? metres
      : `${degrees(latitude, x, y, "N", "S")} ${degrees(longitude, x, y, "E", "W")} (${metres})`;
  };
  map.addEventListener("pointermove", tell);
  map.addEventListener("pointerdown", tell);
  map.addEventListener("pointerleave", () => { told.textContent = hint; });
}
