# What README promises: its session works when pasted, its tables name what there is.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# session: the commands of the section on curl.
session() { sed -n '/^## A session with curl/,/^## /{/^```sh$/,/^```$/{/^```/d;p}}' "$root/README.md"; }

@test "the curl session runs as it stands and ends with files on disk" {
  mkdir -p server
  ln -s "$samples" server/samples
  session | sed "s#^tweend=http://127.0.0.1:8080\$#tweend=$url#" >session.sh
  grep -q "^tweend=$url" session.sh
  bash -e -u -o pipefail session.sh >printed
  cat printed
  cd session
  for file in cube.glb octopus.glb standing.glb tank.glb; do [ "$(head -c 4 "$file")" = glTF ]; done
  [ "$(grep -c '^f ' cube.obj)" = 96 ]
  jq -e '(.poses | length) == 241' drive.json
  grep -q '1572864' ../printed
}

@test "its table of flags is what --help lists" {
  needs_process
  "${TESTED_BINARY:-$root/build/tweend}" --help | grep -oE '^ +--[a-z0-9-]+' | grep -vE -- '--(help|man|version)$' | tr -d ' ' | sort >help
  sed -n '/^## Configuration/,/^## /p' "$root/README.md" | grep -oE '^\| `--[a-z0-9-]+' | tr -d '|` ' | sort >readme
  diff help readme
}

@test "its table of packages is server/packages" {
  sed 's/[[:space:]]*#.*//' "$root/server/packages" | grep . | sort >packages
  sed -n '/^## What it needs/,/^## /p' "$root/README.md" | grep -oE '^\| `[^`]+' | tr -d '|` ' | sort >readme
  diff packages readme
}

@test "its table of paths is what openapi.json describes" {
  get /openapi.json
  value '.paths | keys[]' | sed -E 's/(surface|pose)\.[a-z]+$/\1/' | sort -u >described
  sed -n '/^## API/,/^## /p' "$root/README.md" | grep '^| `' | cut -d'|' -f2 | grep -oE '/[^`?]*' | sort -u >readme
  diff described readme
}

@test "its picture is drawn from the daemon's answers" {
  command -v node >/dev/null || skip "needs node"
  node "$samples/picture.mjs" "$url" >picture.svg
  # Order and rounding may change, the faces may not.
  faces() { tr -cd z <"$1" | wc -c; }
  drawn=$(faces picture.svg) kept=$(faces "$samples/picture.svg")
  ((drawn * 100 > kept * 98 && drawn * 98 < kept * 100))
}

@test "every file that it links is there" {
  grep -oE '\]\([^)#]+\)' "$root/README.md" | tr -d '])(' | grep -v '^http' | while read -r file; do
    [ -e "$root/$file" ] || { echo "$file is missing"; exit 1; }
  done
}
