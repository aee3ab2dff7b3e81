//! The Debian package, as a stranger meets it on a machine with systemd.

mod journal;
mod life;
mod restrictions;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use tests::guide::{Place, tell};
use tests::system::{System, attempt, install, run};

/// The main pages of the manual.
const MANUAL: [&str; 3] = ["axisd.8", "axisctl.1", "axisd.toml.5"];

fn exists(path: &str) -> bool {
    Path::new(path).exists()
}

#[test]
fn installed_it_is_whole_and_nothing_runs() {
    let _system = System::installed();

    assert_eq!(run("dpkg", &["--verify", "axisd"]), "");
    assert!(run("getent", &["passwd", "axisd"]).ends_with(":/usr/sbin/nologin\n"));
    for unit in ["axisd.service", "axisd@left.service"] {
        let state = |verb| String::from_utf8(attempt("systemctl", &[verb, unit]).stdout).expect("UTF-8");
        assert_eq!((state("is-enabled").as_str(), state("is-active").as_str()), ("disabled\n", "inactive\n"));
    }
    for program in ["axisd", "axisctl"] {
        let version = run(program, &["--version"]);
        assert_eq!(version, format!("{program} {}\n", env!("CARGO_PKG_VERSION")));
    }
}

#[test]
fn the_configuration_and_every_example_are_good() {
    let _system = System::installed();
    let examples = fs::read_dir("/usr/share/doc/axisd/examples").expect("there are examples");
    let examples = examples.map(|entry| entry.expect("a readable directory").path().display().to_string());
    let examples = examples.filter(|file| file.ends_with(".toml"));

    let files: Vec<String> = examples.chain(["/etc/axisd/axisd.toml".to_owned()]).collect();

    assert!(files.len() > 4, "{files:?}");
    for file in &files {
        assert!(run("axisd", &["check", file]).contains(": ok ("), "{file}");
    }
}

#[test]
fn the_shipped_profiles_are_there_to_copy_from() {
    let system = System::installed();
    let copy = fs::read_to_string("/usr/share/axisd/devices/cia402-servo.toml").expect("it is there");
    fs::write("/etc/axisd/devices/mine.toml", copy).expect("there is a place for it");
    let shipped = fs::read_to_string("/etc/axisd/axisd.toml").expect("it is there");
    let config = shipped.replace("\"cia402-servo\"", "\"mine\"");
    assert_ne!(config, shipped);

    let service = system.service(Some(&config));
    service.start();

    fs::remove_file("/etc/axisd/devices/mine.toml").expect("it was there");
}

#[test]
fn every_manual_page_is_found_and_renders_without_a_warning() {
    let _system = System::installed();
    let verbs = ["axisd-run.8", "axisd-check.8", "axisd-eds.8", "axisctl-status.1", "axisctl-fault-inject.1"];
    for page in MANUAL.iter().chain(&verbs) {
        let (name, section) = page.rsplit_once('.').expect("a name with a section");
        let output = attempt("man", &["--warnings", "--encoding=UTF-8", section, name]);
        let (text, warnings) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success() && text.contains("NAME"), "{page}: {text}");
        assert_eq!(warnings, "", "{page}");
    }
    // Subcommands are there without having been asked for.
    let verbs = run("axisctl", &["--help"]);
    let verbs =
        verbs.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    for verb in verbs.filter_map(|line| line.split_whitespace().next()).filter(|verb| *verb != "help") {
        assert!(exists(&format!("/usr/share/man/man1/axisctl-{verb}.1.gz")), "axisctl {verb} has no page");
    }
}

#[test]
fn bash_completes_subcommands() {
    let _system = System::installed();
    let complete = "source /usr/share/bash-completion/completions/axisctl\n\
                    COMP_WORDS=(axisctl fault inj) COMP_CWORD=2\n\
                    _axisctl axisctl inj fault; echo \"${COMPREPLY[@]}\"";

    assert_eq!(run("bash", &["-c", complete]), "inject\n");
    for file in ["zsh/vendor-completions/_axisd", "fish/vendor_completions.d/axisd.fish"] {
        let text = fs::read_to_string(Path::new("/usr/share").join(file)).expect("it is there");
        assert!(text.contains("eds") && text.contains("socketcand"), "{file}");
    }
}

#[test]
fn an_upgrade_leaves_the_daemon_running_and_the_configuration_as_it_is() {
    let system = System::installed();
    let edited = fs::read_to_string("/etc/axisd/axisd.toml").expect("it is there").replace("axis1", "edited");
    let service = system.service(Some(&edited));
    service.start();
    let pid = service.pid();

    let said = install();

    assert!(said.contains("When the machine may stop: systemctl restart axisd.service\n"), "{said}");
    assert_eq!(service.pid(), pid);
    assert!(run("axisctl", &["status"]).contains("edited"));
    service.stop();
    service.start();
    assert!(run("axisctl", &["status"]).contains("edited"));
}

#[test]
fn the_install_document_works() {
    let system = System::new();
    system.purge();

    assert!(tell("docs/install.md", Place::Package, None) > 10);

    assert!(!exists("/usr/bin/axisd"));
    let drop_in = "/etc/systemd/system/axisd.service.d";
    fs::remove_dir_all(drop_in).expect("the document makes it");
}

#[test]
fn the_troubleshooting_document_works() {
    let system = System::installed();
    let service = system.service(None);
    service.start();

    assert!(tell("docs/troubleshooting.md", Place::Package, None) > 1);
}

/// Every path below, without what dpkg and others write about any package.
fn files() -> BTreeSet<String> {
    let list = run("find", &["/etc", "/usr", "/var", "/opt", "-xdev"]);
    let is_ours = |path: &&str| {
        let others = ["/var/lib/dpkg/", "/var/log/", "/var/cache/", "/var/lib/systemd/", "/var/tmp/"];
        // Copies from before the last change, as every tool that changes users leaves them.
        let is_backup = path.starts_with("/etc/") && path.ends_with('-') || *path == "/etc/.pwd.lock";
        !is_backup && !others.iter().any(|other| path.starts_with(other))
    };
    list.lines().filter(is_ours).map(str::to_owned).collect()
}

#[test]
fn removed_it_stops_and_purged_it_leaves_nothing() {
    let system = System::new();
    system.purge();
    let users =
        || ["/etc/passwd", "/etc/group", "/etc/shadow"].map(|file| fs::read_to_string(file).expect("root"));
    let (files_before, users_before) = (files(), users());

    install();
    let config = fs::read_to_string("/etc/axisd/axisd.toml").expect("it is there");
    let (service, left) =
        (system.service(None), system.instance("left", "[[bus]]\nname = \"b\"\nlink = \"virtual\"\n"));
    run("systemctl", &["enable", "--now", "axisd.service", "axisd@left.service"]);
    fs::write("/etc/axisd/devices/mine.toml", "").expect("a profile of one's own");
    let (pid, other) = (service.pid(), left.pid());

    run("dpkg", &["--remove", "axisd"]);

    for pid in [pid, other] {
        assert!(!exists(&format!("/proc/{pid}")), "a daemon goes on");
    }
    assert_eq!(fs::read_to_string("/etc/axisd/axisd.toml").expect("configuration stays"), config);
    assert!(exists("/var/lib/axisd/lock") && exists("/etc/axisd/left.toml"));
    assert!(!exists("/etc/systemd/system/multi-user.target.wants/axisd@left.service"));

    run("dpkg", &["--purge", "axisd"]);

    let (new, gone): (Vec<_>, Vec<_>) = (
        files().difference(&files_before).cloned().collect(),
        files_before.difference(&files()).cloned().collect(),
    );
    assert_eq!((new, gone), (Vec::<String>::new(), Vec::<String>::new()));
    assert_eq!(users(), users_before);
    assert!(!exists("/run/axisd"));
}
