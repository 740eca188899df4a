# The layer rule holds, and the check that says so sees every kind of breach.

setup() {
  root=$(cd "$BATS_TEST_DIRNAME/../.." && pwd)
  check=$root/tests/layers/check
}

# A copy of the sources in which a test may plant a breach.
copy() {
  tree=$BATS_TEST_TMPDIR/tree
  mkdir "$tree"
  (cd "$root" && find lib api server tests -path '*/node_modules' -prune -o -type f \
    \( -name '*.[ch]' -o -name '*.[ch]pp' \) -print0 | tar c --null -T -) | tar x -C "$tree"
}

@test "the tree keeps to server, api, lib" {
  run "$check"
  echo "$output"
  [ "$status" -eq 0 ]
}

# shellcheck disable=SC2016 # backticks of Markdown
# What READMEs name: `function` or `member`, `file` without its extension, and room/file.c.
@test "the READMEs of lib, api, server and tests name what there is" {
  cd "$root"
  sources() { find lib api server tests CMakeLists.txt -path '*/node_modules' -prune -o -type f "$@"; }
  { sources -regex '.*[.]\(c\|h\|cpp\|hpp\|js\|mjs\|txt\|cmake\)' -print0 | xargs -0 grep -ohE '[A-Za-z_][A-Za-z0-9_]*'
    sources -print | sed 's#.*/##; s/[.].*//'; } | sort -u >"$BATS_TEST_TMPDIR/names"
  sources -print >"$BATS_TEST_TMPDIR/files"
  for room in lib api server tests; do
    grep -ohE '`[A-Za-z][A-Za-z0-9_]*`' "$room/README.md" | tr -d '`' | sort -u | comm -23 - "$BATS_TEST_TMPDIR/names"
    grep -oE '(^|[ (`])[a-z0-9_/]+[.](c|h|cpp|mjs|js)\b' "$room/README.md" | tr -d ' (`' | sort -u |
      while read -r file; do grep -qE "(^|/)$file\$" "$BATS_TEST_TMPDIR/files" || echo "$file"; done
  done >"$BATS_TEST_TMPDIR/missing"
  cat "$BATS_TEST_TMPDIR/missing"
  [ ! -s "$BATS_TEST_TMPDIR/missing" ]
}

@test "each source of lib, api and server is named in the README of its layer" {
  cd "$root"
  for room in lib api server; do
    find "$room" -path '*/node_modules' -prune -o -type f -regex '.*[.]\(c\|cpp\|js\)' -print | while read -r file; do
      name=${file##*/}
      grep -qw -- "${name%%.*}" "$room/README.md" || echo "$file"
    done
  done >"$BATS_TEST_TMPDIR/unnamed"
  cat "$BATS_TEST_TMPDIR/unnamed"
  [ ! -s "$BATS_TEST_TMPDIR/unnamed" ]
}

# All in one tree, since looking at one takes a second: each must be seen at its file, and nothing else.
@test "each breach that is planted is seen" {
  copy
  plant() {
    echo "$2" >>"$tree/$1"
    echo "$1" >>planted
  }
  cd "$BATS_TEST_TMPDIR"
  plant lib/base/base.c '#include <sys/socket.h>' # lib must not include a socket header
  plant lib/base/base.c '#  include <pthread.h>' # lib must not include pthread.h
  plant lib/mesh/planted.c '#include <cjson/cJSON.h>' # lib must not include cJSON
  plant lib/include/tweend/mesh.h '#include <microhttpd.h>' # lib must not include libmicrohttpd
  plant lib/base/base.c '#include "api.h"' # lib must not include api.h
  plant lib/base/base.c '#include "../api/include/api.h"' # lib must not climb into api
  plant lib/format/gltf/planted.cpp '#include <fstream>' # lib's C++ must not open files
  plant lib/mesh/planted.cpp '' # lib must not hold C++ outside lib/format/gltf
  plant lib/mesh/planted.c '#include "crease.h"' # lib's rooms include downward only
  plant lib/anim/clip.c '#include "crease.h"' # lib's animation knows no subdivision
  plant lib/eval/planted.c '#include "surface.h"' # lib's evaluators know no surface
  plant server/weld.h '' # header names are unique
  plant api/http/problem.c '#include <microhttpd.h>' # api must not include libmicrohttpd
  plant api/http/problem.c '#include <fcntl.h>' # api must not include file headers
  plant api/http/problem.c '#include "store.h"' # api must not include the server's headers
  plant server/main.c '#include "tweend/mesh.h"' # server must not include lib's headers
  plant server/main.c '#include <tweend/mesh.h>' # server must not take lib's headers for system headers
  plant server/planted.c '#include <microhttpd.h>' # server includes microhttpd.h in the I/O threads' files alone
  plant server/planted.cpp '' # server must not hold C++
  run "$check" "$tree"
  echo "$output"
  [ "$status" -eq 1 ]
  diff <(sort planted) <(cut -d: -f1 <<<"$output" | sort)
}

@test "units must not include each other in a circle" {
  copy
  for folder in lib/mesh api/http server; do
    touch "$tree/$folder/${folder%%/*}_one.h"
    echo "#include \"${folder%%/*}_one.h\"" >"$tree/$folder/${folder%%/*}_two.h"
    echo "#include \"${folder%%/*}_two.h\"" >"$tree/$folder/${folder%%/*}_one.c"
  done
  run "$check" "$tree"
  echo "$output"
  [ "$status" -eq 1 ]
  [ "${#lines[@]}" -eq 3 ]
  for layer in lib api server; do
    [[ $output == *"$layer: units include each other in a circle: "*"${layer}_"* ]]
  done
}
@test "api must not include lib's private headers" {
  copy
  touch "$tree/lib/mesh/private.h"
  echo '#include "private.h"' >>"$tree/api/http/problem.c"
  run "$check" "$tree"
  [ "$status" -eq 1 ]
  [[ $output == *'"private.h" is not of this layer' ]]
}

@test "lib calls no function of files, threads, clocks or the environment" {
  library=${TWEEND_BUILD:-$root/build}/libtweend.a
  [ -f "$library" ] || skip "not built"
  run "$root/tests/layers/symbols" "$library"
  echo "$output"
  [ "$status" -eq 0 ]
}

@test "a call that lib must not make is seen" {
  echo 'int getenv(const char *); int planted(void) { return getenv("HOME"); }' >"$BATS_TEST_TMPDIR/planted.c"
  cc -w -c -o "$BATS_TEST_TMPDIR/planted.o" "$BATS_TEST_TMPDIR/planted.c"
  run "$root/tests/layers/symbols" "$BATS_TEST_TMPDIR/planted.o"
  [ "$status" -eq 1 ]
  [ "$output" = getenv ]
}

@test "calls go downward, and in no circle" {
  built=${TWEEND_BUILD:-$root/build}
  [ -f "$built/libtweend.a" ] || skip "not built"
  run "$root/tests/layers/calls" --tree="$root" "$built"/CMakeFiles/tweend{,_lib,_gltf,_api,_server}.dir
  echo "$output"
  [ "$status" -eq 0 ]
}

# object PATH SOURCE: compiles it to that place below the test's folder.
object() {
  mkdir -p "$BATS_TEST_TMPDIR/$(dirname "$1")"
  cc -w -x c -c -o "$BATS_TEST_TMPDIR/$1.c.o" - <<<"$2"
}

@test "a call upward is seen, between layers and between rooms" {
  object lib/base/low 'int high(void); int low(void) { return high(); }'
  object lib/mesh/high 'int top(void); int high(void) { return top(); }'
  object api/http/top 'int top(void) { return 1; }'
  run "$root/tests/layers/calls" "$BATS_TEST_TMPDIR"
  [ "$status" -eq 1 ]
  [ "$output" = $'lib/base/low -> lib/mesh/high: high\nlib/mesh/high -> api/http/top: top' ]
}

@test "a circle of calls is seen" {
  object server/one 'int two(void); int one(void) { return two(); }'
  object server/two 'int three(void); int two(void) { return three(); }'
  object server/three 'int one(void); int three(void) { return one(); }'
  object server/four 'int one(void); int four(void) { return one(); }'
  run "$root/tests/layers/calls" "$BATS_TEST_TMPDIR"
  [ "$status" -eq 1 ]
  [[ $output == 'files call each other in a circle: '* && $output == *server/two* && $output != *four* ]]
}

@test "each public header compiles alone, as C11 and as C++17" {
  cd "$root"
  for header in lib/include/tweend/*.h api/include/*.h; do
    echo "$header"
    cc -std=c11 -Wall -Wextra -Wpedantic -Werror -fsyntax-only -Ilib/include -Iapi/include -include stddef.h -x c "$header"
    c++ -std=c++17 -Wall -Wextra -Werror -fsyntax-only -Ilib/include -Iapi/include -x c++ "$header"
  done
}
