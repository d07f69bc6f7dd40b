//! The page of `rayfront view` in headless Chromium, controlled through its driver. Runs only if `RAYFRONT_BROWSER` is
//! set, as `.ci/run` does; then both programs are required.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::view::Shown;

const PATIENCE: Duration = Duration::from_secs(60);

/// A browser with one window (W3C WebDriver).
struct Browser {
    driver: Child,
    agent: ureq::Agent,
    session: String,
}

impl Drop for Browser {
    fn drop(&mut self) {
        // This closes the browser, too.
        let _ = self.agent.delete(&self.session).call();
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

impl Browser {
    fn new(width: u32, height: u32) -> Browser {
        let mut driver = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver: install chromium-driver");
        let lines = BufReader::new(driver.stdout.take().expect("its output")).lines();
        let port = lines.map_while(Result::ok).find_map(|line| {
            let (_, port) = line.split_once("started successfully on port ")?;
            port.trim_end_matches('.').parse::<u16>().ok()
        });
        let base = format!("http://127.0.0.1:{}/session", port.expect("its port"));
        let agent: ureq::Agent = ureq::Agent::config_builder().timeout_global(Some(PATIENCE)).build().into();
        let options = json!({"args": [
            "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--disable-quic", "--no-first-run",
            "--disable-background-networking", "--disable-component-update", "--disable-sync",
            format!("--window-size={width},{height}"),
        ]});
        let logs = json!({"browser": "ALL"});
        let wanted = json!({"goog:chromeOptions": options, "goog:loggingPrefs": logs});
        let wanted = json!({"capabilities": {"alwaysMatch": wanted}});
        let mut browser = Browser { driver, agent, session: base };
        let session = browser.post("", wanted);
        let id = session["sessionId"].as_str().expect("a session").to_owned();
        browser.session = format!("{}/{id}", browser.session);
        browser
    }

    fn post(&self, path: &str, body: Value) -> Value {
        let address = format!("{}{path}", self.session);
        let mut response = self.agent.post(&address).send(body.to_string()).expect("the driver");
        let text = response.body_mut().read_to_string().expect("text");
        let answer: Value = serde_json::from_str(&text).expect("JSON");
        answer["value"].clone()
    }

    fn open(&self, address: &str) {
        self.post("/url", json!({"url": address}));
    }

    /// Runs a script and returns its value.
    fn run(&self, script: &str) -> Value {
        self.post("/execute/sync", json!({"script": script, "args": []}))
    }

    /// Repeats a script until its value is neither null, false nor empty, and returns that.
    fn when(&self, what: &str, script: &str) -> Value {
        let start = Instant::now();
        loop {
            let value = self.run(script);
            if value != Value::Null && value != json!(false) && value != json!("") {
                return value;
            }
            assert!(start.elapsed() < PATIENCE, "{what} has not come");
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    /// Presses the mouse button at a point of the image (as fractions of its width and height), optionally drags, and
    /// releases.
    fn drag(&self, from: [f64; 2], way: [i32; 2]) {
        let place = self.run("const r = document.getElementById('image').getBoundingClientRect(); return [r.x, r.y, r.width, r.height];");
        let number = |i: usize| place[i].as_f64().expect("a place");
        let [x, y] = [number(0) + from[0] * number(2), number(1) + from[1] * number(3)].map(|at| at as i32);
        let moved = |x: i32, y: i32| json!({"type": "pointerMove", "duration": 50, "x": x, "y": y});
        let steps = [
            moved(x, y),
            json!({"type": "pointerDown", "button": 0}),
            moved(x + way[0] / 2, y + way[1] / 2),
            moved(x + way[0], y + way[1]),
            json!({"type": "pointerUp", "button": 0}),
        ];
        let steps = if way == [0, 0] { json!([steps[0], steps[1], steps[4]]) } else { json!(steps) };
        let pointer = json!({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": steps});
        self.post("/actions", json!({"actions": [pointer]}));
    }

    /// Saves a screenshot for manual inspection.
    fn photograph(&self, name: &str) {
        let mut response =
            self.agent.get(format!("{}/screenshot", self.session)).call().expect("a screenshot");
        let text = response.body_mut().with_config().limit(64 << 20).read_to_string().expect("text");
        let answer: Value = serde_json::from_str(&text).expect("JSON");
        let bytes = decoded(answer["value"].as_str().unwrap_or_default());
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("view");
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join(name), bytes).expect("a picture");
    }

    /// Returns the errors in the page's log.
    fn complaints(&self) -> Vec<String> {
        let log = self.post("/se/log", json!({"type": "browser"}));
        let lines = log.as_array().cloned().unwrap_or_default();
        let severe = lines.iter().filter(|line| line["level"] == "SEVERE");
        severe.map(|line| line["message"].as_str().unwrap_or_default().to_owned()).collect()
    }
}

/// Decodes base 64.
fn decoded(text: &str) -> Vec<u8> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bytes = Vec::new();
    let (mut bits, mut count) = (0u32, 0);
    for digit in text.bytes().filter_map(|byte| DIGITS.iter().position(|digit| *digit == byte)) {
        (bits, count) = (bits << 6 | digit as u32, count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count) as u8);
        }
    }
    bytes
}

/// A checksum of the pixels that the page shows, and the size of the image.
const PIXELS: &str = "const c = document.getElementById('image'); if (!c.width || c.width < 96) return null; \
    const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let s = 0; \
    for (let i = 0; i < d.length; i++) s = (s * 31 + d[i]) % 1000000007; return [s, c.width, c.height];";
const DONE: &str = "return document.getElementById('time-left').textContent === 'done';";

#[test]
fn page_shows_explains_and_updates_the_image_in_a_browser() {
    if std::env::var_os("RAYFRONT_BROWSER").is_none() {
        eprintln!("not asked for: RAYFRONT_BROWSER is not set");
        return;
    }
    let shown = Shown::new();
    let browser = Browser::new(1400, 900);
    browser.open(&shown.address());
    browser.when("the image", PIXELS);
    browser.when("the last sample", DONE);
    std::thread::sleep(Duration::from_millis(300));
    let first = browser.run(PIXELS);
    assert_eq!((&first[1], &first[2]), (&json!(96), &json!(54)));
    browser.photograph("image.png");

    // A click on a pixel explains it.
    browser.drag([0.5, 0.55], [0, 0]);
    let text = "return document.getElementById('explanation').textContent;";
    browser.when(
        "the explanation",
        &format!(
            "{} && document.getElementById('explanation').textContent.includes('ball');",
            text.trim_end_matches(';')
        ),
    );
    let explained = browser.run(text);
    let explained = explained.as_str().unwrap_or_default();
    assert!(
        explained.contains("ball") && explained.contains("paint") && explained.contains("lamp"),
        "{explained}"
    );
    assert!(explained.contains("the same bits"), "{explained}");
    let drawn = browser.run("return document.querySelectorAll('#overlay polyline, #overlay line, #overlay path, #overlay circle').length;");
    assert!(drawn.as_u64() >= Some(2), "the path is drawn over the image: {drawn}");
    browser.photograph("explanation.png");

    // Changing the layer and the exposure does not render again.
    let serial = shown.when("a status", |_| true)["serial"].clone();
    browser.run("const l = document.getElementById('layer'); l.value = 'normal'; l.dispatchEvent(new Event('change', {bubbles: true}));");
    browser.when("normals", &changed(&first));
    browser.photograph("normals.png");
    browser.run("const l = document.getElementById('layer'); l.value = 'light'; l.dispatchEvent(new Event('change', {bubbles: true}));");
    browser.when("the image again", &same(&first));
    assert_eq!(shown.when("a status", |_| true)["serial"], serial, "nothing was rendered for it");

    // Dragging rotates the camera.
    browser.drag([0.5, 0.5], [120, 40]);
    shown.when("a moved camera", |status| status["camera"]["is_moved"] == true && status["is_done"] == true);
    browser.when("another image", &changed(&first));
    browser.photograph("moved.png");

    // An invalid edit is reported, and the image stays.
    let text = std::fs::read_to_string(shown.scene()).expect("the scene");
    std::fs::write(shown.scene(), text.replace("radius_m", "radus")).expect("an edit");
    let error = browser.when(
        "the mistake",
        "const e = document.getElementById('error'); return e.checkVisibility() && e.textContent;",
    );
    assert!(
        error.as_str().is_some_and(|error| error.contains("scene.ron:8:") && error.contains("radius_m")),
        "{error}"
    );
    browser.photograph("error.png");
    std::fs::write(shown.scene(), text).expect("an edit");
    browser.when("its mending", "return !document.getElementById('error').checkVisibility();");
    assert_eq!(browser.complaints(), [""; 0]);

    // Without the token the page is denied.
    browser.open(&shown.address().replace("token=", "token=0"));
    let refused = browser.run("return document.body.textContent;");
    assert!(refused.as_str().is_some_and(|text| text.contains("token")), "{refused}");
}

/// Photons are drawn over the image as long as they belong to it.
#[test]
fn page_draws_photons_in_a_browser() {
    if std::env::var_os("RAYFRONT_BROWSER").is_none() {
        eprintln!("not asked for: RAYFRONT_BROWSER is not set");
        return;
    }
    let shown = Shown::with(&super::view::glass(), &["--caustics", "0.25", "--size", "480x270"]);
    let browser = Browser::new(1400, 900);
    browser.open(&shown.address());
    browser.when("the last sample", DONE);
    let state = browser.run("return document.getElementById('photons-state').textContent;");
    assert_eq!(state, "32,400 for each sample.");
    let click = "document.getElementById('show-photons').click(); return true;";
    let text = "return document.getElementById('photons-count').textContent;";
    browser.run(click);
    let first = browser.when("the count", text);
    let counts = first.as_str().unwrap_or_default();
    assert!(counts.starts_with("Of 32,400, ") && counts.contains("directly"), "{counts}");
    let painted = "const c = document.getElementById('landings'); if (c.hidden) return null; \
        const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; \
        let n = 0; for (let i = 3; i < d.length; i += 4) n += d[i] > 0; return n;";
    let many = browser.when("the points", painted);
    assert!(many.as_u64() > Some(5_000), "{many}");
    browser.photograph("photons.png");
    // After a rotation of the camera other photons are drawn.
    browser.drag([0.5, 0.5], [80, 20]);
    shown.when("a moved camera", |status| status["camera"]["is_moved"] == true && status["is_done"] == true);
    let other = "const n = document.getElementById('photons-count').textContent; return n !== FIRST && \
        !document.getElementById('landings').hidden;";
    browser.when("other photons", &other.replace("FIRST", &first.to_string()));
    browser.photograph("photons_moved.png");
    browser.run(click);
    browser.when("no photons", "return document.getElementById('landings').hidden;");
    assert_eq!(browser.complaints(), [""; 0]);
}

/// The page mixes lamps without rendering, and copies the command that does so.
#[test]
fn page_mixes_lamps_in_a_browser() {
    if std::env::var_os("RAYFRONT_BROWSER").is_none() {
        eprintln!("not asked for: RAYFRONT_BROWSER is not set");
        return;
    }
    let shown = Shown::with(super::view::SCENE, &["--light-groups"]);
    let browser = Browser::new(1400, 900);
    browser.open(&shown.address());
    browser.when("the last sample", DONE);
    std::thread::sleep(Duration::from_millis(300));
    let first = browser.run(PIXELS);
    let serial = shown.when("a status", |_| true)["serial"].clone();
    let set = |id: &str, value: &str| {
        let input = format!("const i = document.getElementById('{id}'); i.value = '{value}';");
        browser.run(&format!("{input} i.dispatchEvent(new Event('input', {{bubbles: true}})); return true;"));
    };
    set("light-0", "0.25");
    browser.when("a darker lamp", &changed(&first));
    let darker = browser.run(PIXELS);
    set("light-color-0", "#ff0000");
    browser.when("a red lamp", &changed(&darker));
    browser.photograph("lights.png");
    browser.run(
        "navigator.clipboard.writeText = (text) => { window.copied = text; return Promise.resolve(); }; \
         document.getElementById('copy-mix').click(); return true;",
    );
    let command = browser.when("the command", "return window.copied;");
    let expected = "rayfront scene.ron --light-groups -o scene.film && \
        rayfront mix scene.film --set '\"lamp\".power_w *= (0.25, 0, 0)' -o scene.png";
    assert_eq!(command, expected);
    browser.run("document.getElementById('reset-lights').click(); return true;");
    browser.when("the lamp as it was", &same(&first));
    assert_eq!(shown.when("a status", |_| true)["serial"], serial, "nothing was rendered for it");
    assert_eq!(browser.complaints(), [""; 0]);
}

/// A script that returns true if the page shows other pixels than these.
fn changed(pixels: &Value) -> String {
    format!("const pixels = (() => {{ {PIXELS} }})(); return pixels && pixels[0] !== {};", pixels[0])
}

/// A script that returns true if the page shows these pixels.
fn same(pixels: &Value) -> String {
    format!("const pixels = (() => {{ {PIXELS} }})(); return pixels && pixels[0] === {};", pixels[0])
}

/// The wheel magnifies the image up to the numbers of its pixels; the camera stays.
#[test]
fn page_magnifies_compares_and_edits_in_a_browser() {
    if std::env::var_os("RAYFRONT_BROWSER").is_none() {
        eprintln!("not asked for: RAYFRONT_BROWSER is not set");
        return;
    }
    let shown = Shown::new();
    let browser = Browser::new(1400, 900);
    browser.open(&shown.address());
    browser.when("the last sample", DONE);
    std::thread::sleep(Duration::from_millis(300));
    let first = browser.run(PIXELS);
    let wheel = "const c = document.getElementById('image'), r = c.getBoundingClientRect(); \
        c.dispatchEvent(new WheelEvent('wheel', {deltaY: -200, clientX: r.x + r.width / 2, clientY: r.y + r.height / 2})); \
        return document.querySelectorAll('#numbers text').length;";
    browser.when("the numbers of pixels", &format!("const n = (() => {{ {wheel} }})(); return n > 0;"));
    browser.photograph("numbers.png");
    browser.run("document.getElementById('fit').click(); return true;");
    assert_eq!(shown.when("a status", |_| true)["camera"]["is_moved"], false);

    // A layer has a bar, and greys out what has no effect on it.
    let choose = |id: &str, value: &str| {
        let script = format!("const l = document.getElementById('{id}'); l.value = '{value}';");
        browser
            .run(&format!("{script} l.dispatchEvent(new Event('change', {{bubbles: true}})); return true;"));
    };
    choose("layer", "depth");
    browser.when("a bar", "return !document.getElementById('bar').hidden;");
    let unit = browser.run("return document.getElementById('bar-unit').textContent;");
    let why = browser.run("const e = document.getElementById('exposure'); return e.disabled && e.title;");
    assert!(unit == "m" && why.as_str().is_some_and(|why| why.contains("only Light")), "{unit} {why}");
    choose("layer", "light");

    // What is picked has an outline and a form; a change of its values shows, and beside it the image before.
    browser.drag([0.5, 0.55], [0, 0]);
    browser.when("the outline", "return !document.getElementById('outline').hidden;");
    browser.run("document.getElementById('edit-panel').open = true; return true;");
    browser.when("the list", "return document.getElementById('form-of').options.length > 3;");
    browser.when("the form", "return document.getElementById('form-of').value === 'Material[\"paint\"]';");
    browser.when("a field", "return document.getElementById('field-diffuse') !== null;");
    browser.drag([0.5, 0.95], [0, 0]);
    let floor = "return document.getElementById('picked').textContent === 'floor' && \
        document.getElementById('picked-forms').innerText;";
    let forms = browser.when("the forms of what is picked", floor);
    assert_eq!(
        forms.as_str().map(|text| text.split_whitespace().collect()),
        Some(vec!["shape", "transform"])
    );
    choose("form-of", "Material[\"paint\"]");
    browser.when("the form again", "return document.getElementById('field-diffuse') !== null;");
    let why = browser.run("return document.getElementById('field-kt').closest('.field').innerText;");
    assert!(why.as_str().is_some_and(|why| why.contains("does nothing without an ior")), "{why}");

    // The boxes of the tree.
    browser.run(
        "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'b', bubbles: true})); return true;",
    );
    browser.when("boxes", "return document.querySelectorAll('#boxes path').length >= 2;");
    let said = browser.run("return document.getElementById('boxes-state').textContent;");
    assert!(said.as_str().is_some_and(|said| said.starts_with("level 1 of")), "{said}");
    browser.photograph("boxes.png");
    let last = "const l = document.getElementById('boxes-level'); l.value = '99'; \
        l.dispatchEvent(new Event('input', {bubbles: true})); return l.value === l.max;";
    assert_eq!(browser.run(last), true, "a level that the tree does not have");
    browser.run("document.getElementById('show-boxes').click(); return true;");
    browser.when("no boxes", "return document.querySelectorAll('#boxes path').length === 0;");
    // The steps of a wave.
    browser.run(
        "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'w', bubbles: true})); return true;",
    );
    browser
        .when("the wave", "return document.getElementById('step-name').textContent === 'Turn 1, generate';");
    browser.run("window.first = document.getElementById('steps-region').textContent; return true;");
    browser.drag([0.5, 0.8], [0, 0]);
    let chosen =
        "const t = document.getElementById('steps-region').textContent; return t !== window.first && t;";
    browser.when("a wave of the floor", chosen);
    // The click has picked the floor, too, whose form comes when the server has answered.
    let other_form = "return document.getElementById('form-of').value !== 'Material[\"paint\"]';";
    browser.when("the form of the floor", other_form);
    for stage in ["intersect", "retire", "shade"] {
        browser.run("document.getElementById('next-step').click(); return true;");
        let name = browser.run("return document.getElementById('step-name').textContent;");
        assert_eq!(name, format!("Turn 1, {stage}"));
    }
    let lanes = browser.run(
        "return [document.querySelectorAll('#steps path').length, document.querySelectorAll('#step-lanes rect').length];",
    );
    assert!(
        lanes[0].as_u64().is_some_and(|it| it > 2) && lanes[1].as_u64().is_some_and(|it| it > 16),
        "{lanes}"
    );
    browser.photograph("steps.png");
    browser.drag([0.02, 0.03], [0, 0]);
    browser.when(
        "another wave",
        "return document.getElementById('steps-region').textContent.includes('pixels 0–31, 0–31');",
    );
    browser.run("document.getElementById('previous-step').focus(); document.activeElement.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape', bubbles: true})); return true;");
    browser.when("no wave", "return !document.getElementById('steps-panel').open && document.querySelectorAll('#steps path').length === 0;");
    choose("form-of", "Material[\"paint\"]");
    browser.when("the form of the paint", "return document.getElementById('field-ior') !== null;");
    // What was idle becomes useful while its cause has the focus, and dark colours have a colour to choose.
    browser.run(
        "const l = document.getElementById('field-ior'); l.focus(); l.value = '1.5'; \
         for (const it of ['input', 'change']) l.dispatchEvent(new Event(it, {bubbles: true})); return true;",
    );
    browser.when("a field that is useful", "return !document.getElementById('field-kt').disabled;");
    assert_eq!(browser.run("return document.activeElement.id;"), "field-ior");
    browser.run(
        "const l = document.getElementById('field-emission-color'); l.value = '#ff0000'; \
         for (const it of ['input', 'change']) l.dispatchEvent(new Event(it, {bubbles: true})); return true;",
    );
    browser.when("a bright colour", "return document.getElementById('field-emission').value === '1';");
    browser.run("document.getElementById('undo-all').click(); return true;");
    browser.when("what was before", "return document.getElementById('field-emission').value === '0';");
    // A pattern takes the place of a constant, whose control has the focus, and a constant that of the pattern.
    browser.run(
        "const l = document.getElementById('field-diffuse-texture'); l.focus(); l.value = 'Checker'; \
         l.dispatchEvent(new Event('change', {bubbles: true})); return true;",
    );
    let patterned = "return document.getElementById('field-diffuse.scale') !== null && \
        document.activeElement.id === 'field-diffuse';";
    browser.when("the form of a pattern", patterned);
    choose("field-diffuse", "constant");
    browser.when("a constant", "return document.getElementById('field-diffuse').matches('input');");
    browser.run("document.getElementById('undo-all').click(); return true;");
    browser.when("the old constant", "return document.getElementById('field-diffuse').value === '0.8';");
    choose("field-diffuse", "0.05");
    shown.when("the change", |status| status["edits"][0].is_string() && status["is_done"] == true);
    browser.when("another image", &changed(&first));
    choose("compare", "previous");
    browser.when("the image before", "return !document.getElementById('other').hidden;");
    browser.photograph("edited.png");
    browser.when("the button", "return !document.getElementById('save-edits').disabled;");
    browser.run("document.getElementById('save-edits').click(); return true;");
    shown.when("the file", |status| status["edits"] == json!([]));
    let text = std::fs::read_to_string(shown.scene()).expect("the scene");
    assert!(text.contains("\"paint\": (diffuse: (0.05, 0.2, 0.1))"), "{text}");
    assert_eq!(browser.complaints(), [""; 0]);
}

/// A page of an earlier run on the same port tells so, and changes nothing in the new one.
#[test]
fn page_of_an_earlier_run_tells_so_in_a_browser() {
    if std::env::var_os("RAYFRONT_BROWSER").is_none() {
        eprintln!("not asked for: RAYFRONT_BROWSER is not set");
        return;
    }
    let first = Shown::new();
    let browser = Browser::new(1400, 900);
    browser.open(&first.address());
    browser.when("the last sample", DONE);
    let port = first.address().split([':', '/']).nth(4).expect("a port").to_owned();
    drop(first);
    let second = Shown::with(super::view::SCENE, &["--port", &port]);
    let notice = "const c = document.getElementById('connection'); \
        return c.checkVisibility() && c.textContent.includes('earlier run');";
    browser.when("the notice", notice);
    browser.drag([0.5, 0.5], [120, 40]);
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(second.json("/status")["camera"]["is_moved"], false);
    browser.open(&second.address());
    browser.when("the last sample", DONE);
    assert_eq!(browser.run("return document.getElementById('connection').checkVisibility();"), false);
}

/// Numbers in narrow fields are rounded for display only: what is sent has all of their digits.
#[test]
fn page_sends_numbers_that_it_rounds_exactly_in_a_browser() {
    if std::env::var_os("RAYFRONT_BROWSER").is_none() {
        eprintln!("not asked for: RAYFRONT_BROWSER is not set");
        return;
    }
    let scene = super::view::SCENE.replace("(0.8, 0.2, 0.1)", "(0.123456, 0.00123456, 0.1)");
    let shown = Shown::with(&scene, &[]);
    let browser = Browser::new(1400, 900);
    browser.open(&shown.address());
    browser.when("the last sample", DONE);
    browser.run("document.getElementById('edit-panel').open = true; return true;");
    let values = "return document.getElementById('field-diffuse') && \
        ['', '-green', '-blue'].map((end) => document.getElementById('field-diffuse' + end).value);";
    assert_eq!(browser.when("the form", values), json!(["0.12346", "0.00123", "0.1"]));
    browser.run(
        "const blue = document.getElementById('field-diffuse-blue'); blue.value = '0.5'; \
         blue.dispatchEvent(new Event('change', {bubbles: true})); return true;",
    );
    let status = shown.when("the change", |status| status["edits"][0].is_string());
    assert_eq!(status["edits"][0], r#"Material["paint"].diffuse = (0.123456, 0.00123456, 0.5)"#);
    assert_eq!(browser.complaints(), [""; 0]);
}
