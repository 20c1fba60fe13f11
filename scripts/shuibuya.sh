#!/usr/bin/env bash
# The Shuibuya campaign: runs the batches of cases/shuibuya/campaign, then charts and tables of what there is.
#
#   scripts/shuibuya.sh [--out DIR] [--jobs N] [pressures] [removed] [bending] [companions] [seeds] [increments] [parameters]
#
# Without names all batches are run, in this order. Started again, it leaves finished and stopped runs alone and goes on with interrupted ones.
# Default DIR: cases/shuibuya/campaign/results. With --report it only draws.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
out=$root/cases/shuibuya/campaign/results
jobs=1 run=true
parts=()
while [ $# -gt 0 ]; do
    case $1 in
        --out) out=$2; shift ;;
        --jobs) jobs=$2; shift ;;
        --report) run=false ;;
        -h | --help) sed -n '2,7s/^# \{0,1\}//p' "$0"; exit 0 ;;
        pressures | removed | bending | companions | seeds | increments | parameters) parts+=("$1") ;;
        *) echo "scripts/shuibuya.sh: does not know $1; --help tells" >&2; exit 2 ;;
    esac
    shift
done
[ ${#parts[@]} -gt 0 ] || parts=(pressures removed bending companions seeds increments parameters)
export PATH="$PATH:$HOME/.cargo/bin"
cargo build --release --locked --manifest-path "$root/Cargo.toml"
riprap=${CARGO_TARGET_DIR:-$root/target}/release/riprap
python=$("$root/scripts/python_env")
stopped=0
for part in "${parts[@]}"; do
    if $run; then
        code=0
        "$riprap" batch "$root/cases/shuibuya/campaign/$part.json" --out "$out/$part" --jobs "$jobs" || code=$?
        # 3: a member stopped short of its end. The others are worth having; its reason is in the table.
        case $code in 0) ;; 3) stopped=3 ;; *) exit $code ;; esac
    fi
    mapfile -t files < <(find "$out/$part" \( -name '*.vtkhdf' -o -name '*.h5' \) 2>/dev/null | sort)
    [ ${#files[@]} -gt 0 ] || continue
    "$python" "$root/scripts/shuibuya_tables.py" "${files[@]}" > "$out/$part.md" || continue
    "$riprap" report "${files[@]}" --lab "$root/cases/shuibuya/source.csv" --lab "$root/cases/shuibuya/laboratory.csv" --out "$out/report_$part" || true
done
exit $stopped
