# What README promises: its session works when pasted, its tables name what there is.

load helper
setup_file() { start_daemon; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# run_session HEADING FILE: the commands of a section, as they stand, twice; the file printed has what they print last.
run_session() {
  sed -n "/^## $1/,/^## /{/^\`\`\`sh\$/,/^\`\`\`\$/{/^\`\`\`/d;p}}" "$root/$2" |
    sed "s#^tweend=http://127.0.0.1:8080\$#tweend=$url#" >session.sh
  grep -q "^tweend=$url" session.sh
  for _ in once twice; do bash -e -u -o pipefail session.sh >printed; done
  cat printed
}

@test "the curl session runs as it stands and ends with files on disk" {
  mkdir -p server
  ln -s "$samples" server/samples
  run_session 'A session with curl' README.md
  cd session
  for file in cube.glb octopus.glb standing.glb tank.glb; do [ "$(head -c 4 "$file")" = glTF ]; done
  [ "$(grep -c '^f ' cube.obj)" = 96 ]
  gojq -e '(.poses | length) == 241' drive.json
  grep -q '1572864' ../printed
}

@test "the script of edits makes a tank's hull" {
  run_session 'A model from a script' api/GUIDE.md
  [ "$(wc -l <printed)" = 5 ]
  for file in hull.glb ribbed.glb smooth.glb; do [ "$(head -c 4 "session/$file")" = glTF ]; done
  cmp --silent session/ribbed.glb session/smooth.glb && false
  get "$(tail -n 1 printed | sed "s#^$url##")"
  holds '.meshes[0] | .vertices == 90 and .faces == 88 and .euler_characteristic == 2 and .boundary_edges == 0 and .creases > 0'
}

@test "the table of flags is what --help lists" {
  needs_process
  "${TESTED_BINARY:-$root/build/tweend}" --help | grep -oE '^ +--[a-z0-9-]+' | grep -vE -- '--(help|man|version)$' | tr -d ' ' | sort >help
  sed -n '/^## Flags/,/^## /p' "$root/server/FLAGS.md" | grep -oE '^\| `--[a-z0-9-]+' | tr -d '|` ' | sort >readme
  diff help readme
}

@test "the table of packages is server/packages" {
  sed 's/[[:space:]]*#.*//' "$root/server/packages" | grep . | sort >packages
  sed -n '/^## The daemon/,/^## /p' "$root/server/PACKAGES.md" | grep -oE '^\| `[^`]+' | tr -d '|` ' | sort >readme
  diff packages readme
}

@test "its table of paths is what openapi.json describes" {
  get /openapi.json
  value '.paths | keys[]' | sed -E 's/(surface|pose)\.[a-z0-9]+$/\1/' | sort -u >described
  sed -n '/^## API/,/^## /p' "$root/README.md" | grep '^| `' | cut -d'|' -f2 | grep -oE '/[^`?]*' | sort -u >readme
  diff described readme
}

# picture_is_drawn SCRIPT PICTURE: order and rounding may change, the faces may not.
picture_is_drawn() {
  command -v node >/dev/null || skip "needs node"
  node "$samples/$1" "$url" >drawn.svg
  faces() { tr -cd z <"$1" | wc -c; }
  drawn=$(faces drawn.svg) kept=$(faces "$samples/$2")
  ((drawn * 100 > kept * 98 && drawn * 98 < kept * 100))
}

@test "its picture is drawn from the daemon's answers" { picture_is_drawn picture.mjs picture.svg; }
@test "its picture of the hull is drawn from the daemon's answers" { picture_is_drawn picture_hull.mjs hull.svg; }

@test "its picture of a walk is drawn from the daemon's answers" { picture_is_drawn picture_walk.mjs walk.svg; }

@test "every file that it and its further pages link is there" {
  for page in README.md api/GUIDE.md server/FLAGS.md server/PACKAGES.md; do
    grep -oE '\]\([^)#]+' "$root/$page" | sed 's/^](//' | grep -v '^http' | while read -r file; do
      [ -e "$root/$(dirname "$page")/$file" ] || { echo "$page: $file is missing"; exit 1; }
    done
  done
}
