//! A batch as a job array of Slurm: one task a member, each of which runs `riprap batch PLAN --only K`.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::error::{Error, Result};

use super::plan::Plan;

/// The script of the array. `program` is the riprap to run on the cluster.
pub fn script(plan: &Plan, program: &Path, jobs: Option<usize>, force: bool) -> String {
    // Without a number the cluster says how many run at a time.
    let at_a_time = jobs.map_or(String::new(), |jobs| format!("%{jobs}"));
    let name = plan.file.file_stem().unwrap_or(plan.file.as_os_str()).to_string_lossy().into_owned();
    let mut lines = vec![
        "#!/bin/sh".to_string(),
        format!("#SBATCH --job-name=riprap-{}", super::safe(&name)),
        format!("#SBATCH --array=0-{}{at_a_time}", plan.members.len().saturating_sub(1)),
        "#SBATCH --ntasks=1".to_string(),
        format!("#SBATCH --cpus-per-task={}", plan.threads),
        // Ctrl-C's signal two minutes before the time is up: the run ends cleanly.
        "#SBATCH --signal=B:INT@120".to_string(),
        format!(
            "#SBATCH --output={}",
            quoted(&absolute(&plan.out).join("slurm-%A_%a.log").to_string_lossy())
        ),
    ];
    for (option, value) in
        [("time", &plan.slurm.time), ("mem", &plan.slurm.memory), ("partition", &plan.slurm.partition)]
    {
        if let Some(value) = value {
            lines.push(format!("#SBATCH --{option}={value}"));
        }
    }
    lines.extend(plan.slurm.options.iter().map(|option| format!("#SBATCH {option}")));
    lines.push(String::new());
    lines.push(
        "# exec: the signal reaches riprap itself. When all tasks are done, the same command without --only"
            .into(),
    );
    lines.push("# writes the table; an array submitted again skips what is finished.".into());
    let force = if force { " --force" } else { "" };
    lines.push(format!(
        "exec {} batch {} --out {} --threads {}{force} --only \"$SLURM_ARRAY_TASK_ID\"",
        quoted(&program.to_string_lossy()),
        quoted(&absolute(&plan.file).to_string_lossy()),
        quoted(&absolute(&plan.out).to_string_lossy()),
        plan.threads
    ));
    lines.join("\n") + "\n"
}

/// Writes the script beside the results and hands it to `sbatch` where there is one: the script's path and what sbatch
/// said, if it was there.
///
/// # Errors
/// A script that cannot be written; an sbatch that refuses.
pub fn submit(
    plan: &Plan,
    program: &Path,
    jobs: Option<usize>,
    force: bool,
) -> Result<(PathBuf, Option<String>)> {
    std::fs::create_dir_all(&plan.out).map_err(|e| Error::io("create", &plan.out, e))?;
    let path = plan.out.join("array.sh");
    std::fs::write(&path, script(plan, program, jobs, force)).map_err(|e| Error::io("write", &path, e))?;
    match Command::new("sbatch").arg(&path).output() {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok((path, None)),
        Err(e) => Err(Error::io("start", Path::new("sbatch"), e)),
        Ok(output) if output.status.success() => {
            Ok((path, Some(String::from_utf8_lossy(&output.stdout).trim().to_string())))
        }
        Ok(output) => {
            let said = String::from_utf8_lossy(&output.stderr).trim().to_string();
            Err(Error::Usage(format!("sbatch refused {}: {said}", path.display())))
        }
    }
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}

/// For a shell, whatever the text is.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=%".contains(c);
    match !text.is_empty() && text.chars().all(plain) {
        true => text.to_string(),
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::super::Member;
    use super::super::plan::Slurm;
    use super::*;

    #[test]
    fn the_array_has_a_task_for_each_member() {
        let member = Member {
            name: "a".into(),
            case: "a.json".into(),
            overrides: Vec::new(),
            completed: serde_json::Value::Null,
            results: "a.h5".into(),
        };
        let plan = Plan {
            file: "/x/it's.json".into(),
            members: vec![member.clone(), member.clone(), member],
            out: "/x/out".into(),
            jobs: None,
            threads: 4,
            slurm: Slurm {
                time: Some("1:00".into()),
                options: vec!["--account=a".into()],
                ..Slurm::default()
            },
        };
        assert!(script(&plan, Path::new("/bin/riprap"), None, false).contains("--array=0-2\n"));
        let script = script(&plan, Path::new("/bin/riprap"), Some(2), true);
        for part in [
            "--array=0-2%2\n",
            "--cpus-per-task=4\n",
            "#SBATCH --time=1:00\n",
            "#SBATCH --account=a\n",
            "exec /bin/riprap batch '/x/it'\\''s.json' --out /x/out --threads 4 --force --only \"$SLURM_ARRAY_TASK_ID\"\n",
        ] {
            assert!(script.contains(part), "{script}\nhas no {part}");
        }
        // The array may be submitted from anywhere.
        let plan = Plan { out: "out".into(), ..plan };
        let folder = absolute(Path::new("out"));
        let log = format!("#SBATCH --output={}/slurm-%A_%a.log\n", quoted(&folder.to_string_lossy()));
        assert!(
            self::script(&plan, Path::new("/bin/riprap"), None, false).contains(&log) && folder.is_absolute()
        );
        let (_, behind) = script.split_once("\nexec ").unwrap_or_default();
        assert!(!behind.contains("#SBATCH"), "Slurm reads options up to the first command");
    }
}
