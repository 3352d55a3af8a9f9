//! The page in a browser, with the virtual gripper.

mod browser;
mod served;

use std::sync::{Mutex, PoisonError, mpsc};

use browser::{Browser, seconds_of};
use served::Served;
use watch::{Connection, Observation, Told};

/// One browser at a time, for the virtual gripper runs in real time.
static ALONE: Mutex<()> = Mutex::new(());

/// From the gripper's report to the page, ms.
const LOSS_SHOWS_WITHIN_MS: u64 = 200;

const STATE: &str = "document.getElementById('state').dataset.state";

fn has(state: &str) -> String {
    format!("{STATE} === '{state}'")
}

fn standing(wanted: &str) -> String {
    format!("document.getElementById('standing').dataset.standing === '{wanted}'")
}

/// Pictures of the page, in a folder of the repository:
/// `SOFTGRIP_PANEL_PICTURES=docs cargo test -p softgrip-panel --test page`.
const PICTURES: &str = "SOFTGRIP_PANEL_PICTURES";

fn wants_pictures() -> bool {
    std::env::var_os(PICTURES).is_some()
}

/// A picture shows what was before.
fn pause_for_pictures() {
    if wants_pictures() {
        std::thread::sleep(std::time::Duration::from_secs(3));
    }
}

fn picture(browser: &Browser, name: &str) {
    let Some(folder) = std::env::var_os(PICTURES) else {
        return;
    };
    let picture = browser.picture();
    let bytes = data_encoding::BASE64.decode(picture.as_bytes());
    // Tests run in the folder of their package.
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let path = root.join(folder).join(name);
    std::fs::write(path, bytes.expect("Base64")).expect("a file");
}

#[test]
fn a_grasp_is_commanded_by_clicks_and_a_loss_shows_within_200_ms() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(browser) = Browser::start(1280, 800, "light") else {
        return;
    };
    let served = Served::virtual_gripper();
    browser.open(&served.with_token);
    browser.wait_for(&has("idle"));
    browser.wait_for(&standing("commands"));

    // A busy machine may hold up one loss, but not all.
    let mut quickest = u64::MAX;
    for _ in 0..4 {
        browser.click("button[data-do=grip]");
        browser.wait_for(&has("holding"));
        pause_for_pictures();
        browser.click("button[data-do=pull_out]");
        browser.wait_for(&has("lost"));
        browser.wait_for("document.querySelector('#alarms .alarm.lost')");
        // From what the gripper has told to state and log that show it, all by the clock of this machine.
        let shown = browser.script(
            "const line = document.querySelector('#log li.alarm').dataset;
            const state = document.getElementById('state').dataset;
            return Math.max(line.shownMs, state.shownMs) - line.toldMs",
        );
        quickest = quickest.min(shown.as_u64().expect("a time"));
        if quickest <= LOSS_SHOWS_WITHIN_MS {
            break;
        }
        browser.click("button[data-do=acknowledge]");
        browser.click("button[data-do=release]");
        browser.wait_for(&has("idle"));
        browser.click("button[data-do=appear]");
    }
    // For the manual: the loss that was, and a grip for a payload that is lifted.
    if wants_pictures() {
        pause_for_pictures();
        browser.click("button[data-do=acknowledge]");
        browser.click("button[data-do=release]");
        browser.wait_for(&has("idle"));
        browser.click("button[data-do=appear]");
        browser.click("form[data-do=grip_payload] button");
        browser.wait_for(&has("holding"));
        browser.click("button[data-do=lift]");
        browser.wait_for("parseFloat(document.getElementById('margin').textContent) > 0");
        pause_for_pictures();
        picture(&browser, "panel.png");
    }
    assert!(quickest <= LOSS_SHOWS_WITHIN_MS, "{quickest} ms");
    assert_eq!(browser.console(), Vec::<String>::new());
}

#[test]
fn one_page_commands_and_others_watch_until_it_has_gone() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(browser) = Browser::start(1280, 800, "dark") else {
        return;
    };
    let served = Served::virtual_gripper();
    // Without the token.
    browser.open(&served.address);
    browser.wait_for(&has("idle"));
    browser.wait_for(&standing("no_token"));
    let buttons = "[...document.querySelectorAll('main button, #stop')]";
    browser.wait_for(&format!(
        "{buttons}.length > 10 && {buttons}.every((button) => button.disabled)"
    ));
    // Nor does it help to send what the buttons would.
    let send = "const socket = new WebSocket(`ws://${location.host}/socket`);
        window.answers = [];
        socket.onmessage = ({ data }) => data.includes('answer') && window.answers.push(data);
        socket.onopen = () => ['grip', 'stop', 'take_over'].forEach((name, id) => socket.send(JSON.stringify({ id, do: name })));";
    browser.script(send);
    browser.wait_for("window.answers?.length === 3");
    let answers =
        browser.script("return window.answers.filter((one) => one.includes('no token')).length");
    assert_eq!(answers, 3);
    assert_eq!(browser.script(&format!("return {STATE}")), "idle");

    // The first with the token commands, the second watches.
    let (watching, commanding) = browser.open_another(&served.with_token);
    browser.wait_for(&standing("commands"));
    let (_, second) = browser.open_another(&served.with_token);
    browser.wait_for(&standing("another_commands"));
    assert_eq!(
        browser.script("return document.querySelector('button[data-do=grip]').disabled"),
        true
    );
    browser.switch_to(&commanding);
    browser.click("button[data-do=grip]");
    browser.wait_for(&has("holding"));
    // It may stop the gripper, as anybody with the token.
    browser.switch_to(&second);
    browser.wait_for(&has("holding"));
    browser.click("#stop");
    browser.wait_for(&has("fault"));
    browser.wait_for(
        "document.querySelector('#alarms .alarm.fault .remedy')?.textContent.includes('acknowledge')",
    );
    picture(&browser, "panel-fault.png");

    // Once the first has gone, it can take over.
    browser.switch_to(&commanding);
    browser.close();
    browser.switch_to(&second);
    browser.wait_for(&standing("nobody_commands"));
    browser.click("#take_over");
    browser.wait_for(&standing("commands"));
    browser.click("button[data-do=acknowledge]");
    browser.wait_for(&has("holding"));
    browser.switch_to(&watching);
    browser.wait_for(&has("holding"));
    assert_eq!(browser.console(), Vec::<String>::new());
}

#[test]
fn settings_are_checked_by_field_and_set_and_what_breaks_is_shown_with_its_remedy() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(browser) = Browser::start(1280, 800, "light") else {
        return;
    };
    let served = Served::virtual_gripper();
    browser.open(&served.with_token);
    browser.wait_for(&standing("commands"));
    browser.click("button[data-view=settings]");
    let field = "document.querySelector('[data-number=\"400\"]')";
    browser.wait_for(&format!("{field}.value === '140' && !{field}.disabled"));
    let enter = |value: &str| {
        browser.script(&format!(
            "{field}.value = '{value}'; {field}.dispatchEvent(new Event('input', {{ bubbles: true }}))"
        ));
    };
    enter("2000");
    let error = browser.script(&format!(
        "return {field}.parentElement.querySelector('.error').textContent"
    ));
    assert_eq!(error, "must lie within 1 and 1000 kPa");
    assert_eq!(
        browser.script("return document.getElementById('apply').disabled"),
        true
    );
    enter("125");
    browser.click("#apply");
    browser.wait_for(&format!(
        "!{field}.parentElement.classList.contains('changed')"
    ));
    browser
        .wait_for("document.querySelector('#settings .unsaved').textContent.includes('not saved')");
    picture(&browser, "panel-settings.png");
    browser.click("#settings button[data-do=save]");
    browser.wait_for("document.querySelector('#settings .unsaved').textContent === ''");

    browser.click("button[data-view=operate]");
    browser.click("button[data-do=grip]");
    browser.wait_for(&has("holding"));
    browser.wait_for("document.getElementById('set_kpa').textContent === '125.0'");
    // A broken gauge is done without, and said.
    browser.click("#world form[data-do=break] button");
    browser.wait_for(
        "document.querySelector('#alarms .alarm.fault b')?.textContent === 'Fault 16: GaugeOpen'",
    );
    browser.wait_for(
        "document.querySelector('#alarms .remedy').textContent === 'What to do: repair the wire.'",
    );
    browser.click("#world button[data-do=repair]");
    browser.click("button[data-do=acknowledge]");
    browser.wait_for("!document.querySelector('#alarms .alarm')");
    assert_eq!(browser.console(), Vec::<String>::new());
}

#[test]
fn a_sweep_is_guided_and_shows_what_it_has_learned() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(browser) = Browser::start(1280, 800, "dark") else {
        return;
    };
    let served = Served::virtual_gripper();
    browser.open(&served.with_token);
    browser.wait_for(&standing("commands"));
    // With something between the fingers it is refused, with what to do.
    browser.click("button[data-view=calibrate]");
    browser.click("#calibrate button[data-do=sweep]");
    browser.wait_for("document.getElementById('sweep_result').textContent.includes('take out what is in the grip')");
    browser.click("button[data-view=operate]");
    browser.wait_for(&has("idle"));
    browser.click("button[data-do=pull_out]");
    browser.click("button[data-view=calibrate]");
    browser.wait_for("document.querySelectorAll('#ready .good').length === 4");
    browser.click("#calibrate button[data-do=tare]");
    browser.wait_for("document.getElementById('tare_result').textContent.includes('zeroed')");
    browser.click("#calibrate button[data-do=sweep]");
    browser.wait_for("document.getElementById('sweep_result').classList.contains('good')");
    browser.wait_for("document.querySelectorAll('#learned .changed').length > 3");
    picture(&browser, "panel-calibrate.png");
    assert_eq!(browser.console(), Vec::<String>::new());
}

#[test]
fn a_page_that_comes_after_the_end_of_the_source_shows_what_was_last_and_that_it_is_over() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(browser) = Browser::start(834, 1112, "light") else {
        return;
    };
    let (sender, told) = mpsc::channel();
    let served = Served::of(
        Connection {
            name: "a test".into(),
            rate_hz: 50.0,
            told,
            wishes: None,
        },
        false,
    );
    let last = Observation {
        t_s: Some(12.0),
        state: Some(3),
        pressure_kpa: Some(123.4),
        residual_ue: [Some(9_000.0), Some(8_900.0), None],
        ..Observation::default()
    };
    let ends = [
        Told::Observation(Box::new(last)),
        Told::Failed("the line is gone".into()),
    ];
    for told in ends {
        sender.send(told).expect("sent");
    }
    browser.open(&served.with_token);
    browser.wait_for("document.getElementById('link').textContent === 'source ended'");
    browser.wait_for("document.body.classList.contains('stale')");
    browser.wait_for("document.getElementById('log').textContent.includes('the line is gone')");
    browser.wait_for(&has("holding"));
    browser.wait_for("document.getElementById('kpa').textContent === '123.4'");
    browser.wait_for("document.querySelectorAll('#gauges td')[5].textContent === '8900'");
    browser.wait_for("document.getElementById('stop').disabled");
    picture(&browser, "panel-ended.png");
    assert_eq!(browser.console(), Vec::<String>::new());
}

/// Time of the threads of this process whose name begins so.
fn seconds_of_threads(name: &str) -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task")
        .expect("threads")
        .flatten();
    let stats = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("stat")).ok());
    let named = stats.filter(|stat| stat.contains(&format!("({name}")));
    named.map(|stat| seconds_of(&stat)).sum()
}

#[test]
#[ignore = "measures, for docs/panel.md: cargo test -p softgrip-panel --test page -- --ignored --nocapture"]
fn what_page_and_server_cost() {
    const FOR_S: f64 = 30.0;
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(browser) = Browser::start(1280, 800, "light") else {
        return;
    };
    let served = Served::virtual_gripper();
    browser.open(&served.with_token);
    browser.wait_for(&standing("commands"));
    browser.click("button[data-do=grip]");
    browser.wait_for(&has("holding"));
    let costs = || (browser.seconds(), seconds_of_threads("panel-"));
    for view in ["operate", "settings"] {
        browser.click(&format!("button[data-view={view}]"));
        let (began, before) = (std::time::Instant::now(), costs());
        std::thread::sleep(std::time::Duration::from_secs_f64(FOR_S));
        let (elapsed, after) = (began.elapsed().as_secs_f64(), costs());
        let percent = |from: f64, to: f64| 100.0 * (to - from) / elapsed;
        println!(
            "{view}: browser {:.1} %, server {:.2} % of a core; {} frames per second",
            percent(before.0, after.0),
            percent(before.1, after.1),
            browser.script("return document.getElementById('rate').textContent"),
        );
    }
}
