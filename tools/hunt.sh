#!/usr/bin/env bash
# Looks for bugs for some minutes: property tests with fresh seeds over and over,
# then the fuzz targets.
# Usage: tools/hunt.sh [minutes, 20] [folder for what it finds, out/hunt]
#
# The minutes are shared half and half; without cargo-fuzz the property tests get them all. Building
# comes on top. Ends with 1 if anything was found.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=$(awk -v minutes="${1:-20}" 'BEGIN { printf "%d", 60 * minutes }')
folder=${2:-out/hunt}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)

# Properties with a number of cases of their own (`palpa_testkit::cases`) draw this many times as
# many; the others draw proptest's 256 in each round. (PROPTEST_CASES would override both.)
export PALPA_HUNT_FACTOR=8
# A run that takes longer than this hangs, s.
HANG=1200

findings=()
finding() {
    findings+=("$1")
    printf 'hunt: FOUND %s\n' "$1"
}

# The packages with property tests, and the modules that these are in, as filters.
declare -A modules
while read -r file; do
    package=$(cut -d/ -f2 <<<"$file")
    module=$(sed -E 's#^crates/[^/]*/(tests/it|src)/##; s#(/mod)?\.rs$##; s#/#::#g' <<<"$file")
    modules[$package]+=" $module::"
done < <(grep -rlE 'proptest!|proptest::test_runner' crates --include='*.rs' | sort)

echo "hunt: building, which takes minutes the first time"
packages=("${!modules[@]}")
cargo test --quiet --release --no-run "${packages[@]/#/--package=}"
targets=()
if cargo fuzz --version >/dev/null 2>&1; then
    mapfile -t targets < <(cargo fuzz list)
    fuzz/seed.sh
    RUSTC_BOOTSTRAP=1 cargo fuzz build
else
    echo "hunt: without the fuzz targets; for them: cargo install cargo-fuzz"
fi

start=$SECONDS
n_rounds=0
properties_end=$((start + (${#targets[@]} > 0 ? seconds / 2 : seconds)))
while ((SECONDS < properties_end || n_rounds == 0)); do
    seed=$(od -An -N4 -tu4 /dev/urandom | tr -d ' ')
    n_rounds=$((n_rounds + 1))
    for package in "${packages[@]}"; do
        ((SECONDS < properties_end || n_rounds == 1)) || break
        log="$folder/$package-$seed.log"
        # Word splitting is meant: each module is a filter of its own.
        # shellcheck disable=SC2086
        again="PROPTEST_RNG_SEED=$seed PALPA_HUNT_FACTOR=$PALPA_HUNT_FACTOR cargo test --release --package $package -- ${modules[$package]# }"
        # shellcheck disable=SC2086
        if PROPTEST_RNG_SEED=$seed timeout "$HANG" \
            cargo test --quiet --release --lib --tests --package "$package" -- ${modules[$package]} >"$log" 2>&1; then
            rm "$log"
        else
            printf '\nTo see it again: %s\n' "$again" >>"$log"
            finding "$log"
        fi
    done
done
echo "hunt: $n_rounds rounds of property tests in ${#modules[@]} packages"

for i in "${!targets[@]}"; do
    target=${targets[$i]}
    left=$((start + seconds - SECONDS))
    share=$((left / (${#targets[@]} - i)))
    log="$folder/fuzz-$target.log"
    if RUSTC_BOOTSTRAP=1 cargo fuzz run "$target" -- "-max_total_time=$((share > 5 ? share : 5))" \
        -max_len=4096 -rss_limit_mb=1024 "-artifact_prefix=$folder/fuzz-$target-" >"$log" 2>&1; then
        echo "hunt: $target: $(grep -oE 'Done [0-9]+ runs' "$log" || echo 'done')"
        rm "$log"
    else
        finding "$log"
    fi
done

echo "hunt: $((SECONDS - start)) s, ${#findings[@]} found"
if ((${#findings[@]} > 0)); then
    printf '  %s\n' "${findings[@]}"
    exit 1
fi
