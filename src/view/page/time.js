
// ---- The time of animated scenes ----

const FRAME_MS = 1000 / 24;
const USUAL_END_S = 10; // for scenes that do not give their end

let playing = null; // {from, start} while it plays: the scene's time and the clock's, in seconds

const endOfTime = () => state.time?.end_s ?? USUAL_END_S;

function showTime() {
  byId("time-panel").hidden = state.time === null;
  if (state.time === null) return;
  byId("time").max = endOfTime();
  for (const id of ["time", "time-number"]) show(id, rounded(state.time.now_s, 4));
}

/** Plays in real time: frames that are not rendered in time are left out. */
async function play() {
  if (playing) return stopPlaying();
  const mine = (playing = { from: state.time.now_s % endOfTime(), start: performance.now() / 1000 });
  byId("play").textContent = "Stop";
  while (playing === mine) {
    const begun = performance.now();
    await send({ time_s: (mine.from + begun / 1000 - mine.start) % endOfTime() });
    await new Promise((done) => setTimeout(done, Math.max(0, FRAME_MS - (performance.now() - begun))));
  }
}

function stopPlaying() {
  playing = null;
  byId("play").textContent = "Play";
}

function connectTime() {
  on("play", "click", play);
  on("time", "input", (event) => {
    stopPlaying();
    hold(byId("time-number"));
    byId("time-number").value = event.target.value;
    send({ time_s: event.target.valueAsNumber });
  });
  on("time", "change", () => letGo(byId("time-number")));
  on("time-number", "change", (event) => sendNumber(event.target, (value) => ({ time_s: value })));
}
