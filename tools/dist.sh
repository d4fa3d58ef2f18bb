#!/usr/bin/env bash
# Packs the release binary, which has the page inside, with what belongs to it.
# Usage: tools/dist.sh TARGET-FOLDER VERSION
set -euo pipefail
target=$1 version=$2
host=$(rustc --version --verbose | sed -n 's/^host: //p')
name="palpa-$version-$host"
folder="$target/dist/$name"
rm -rf "$folder"
mkdir -p "$folder"
strip -o "$folder/palpa" "$target/release/palpa"
cp README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE "$folder"
tar -C "$target/dist" -czf "$target/dist/$name.tar.gz" "$name"

# It is no good if it does not bring its page.
"$folder/palpa" view --no-open --port 0 --json --out "$target/dist/try" >"$target/dist/try.json" &
viewer=$!
trap 'kill "$viewer" 2>/dev/null || true' EXIT
for _ in $(seq 100); do
    url=$(sed -n 's/.*"url": "\(.*\)".*/\1/p' "$target/dist/try.json")
    [ -n "$url" ] && break
    sleep 0.1
done
python3 - "$url" <<'END'
import sys, urllib.request
page = urllib.request.urlopen(sys.argv[1]).read().decode()
assert "<script" in page, "the binary was built without its page: run make run, or npm run build in web/, first"
END
kill -INT "$viewer" && wait "$viewer" || true
rm -rf "$target/dist/try" "$target/dist/try.json"
ls -l "$target/dist/$name.tar.gz"
