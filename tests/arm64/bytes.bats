#!/usr/bin/env bats
# Every processor answers the same bytes: this one, an x86-64 with AVX2, one with no more than SSE2, and arm64.
# The last three are emulated; all share one folder of models.

load ../e2e/helper

machines=(here avx2 sse2 arm64)

# machine NAME: sets the folder of its programs and what runs them.
machine() {
  folder=$root/build TESTED_RUNNER=
  case $1 in
  avx2) TESTED_RUNNER="qemu-x86_64 -cpu Haswell" ;;
  sse2) TESTED_RUNNER="qemu-x86_64 -cpu Opteron_G1" ;;
  arm64) folder=$root/build-arm64 TESTED_RUNNER="qemu-aarch64 -L $root/build-arm64/root" ;;
  esac
  TESTED_BINARY=$folder/tweend
}

setup_file() {
  local name
  unset TESTED_URL
  for name in "${machines[@]}"; do
    machine "$name"
    start_daemon
    echo "$url $daemon" >"$BATS_FILE_TMPDIR/$name.daemon"
    mkdir "$BATS_FILE_TMPDIR/$name"
    $TESTED_RUNNER "$folder/tests/write_samples" "$BATS_FILE_TMPDIR/$name"
  done
}

teardown_file() {
  local name
  for name in "${machines[@]}"; do
    read -r url daemon <"$BATS_FILE_TMPDIR/$name.daemon" && kill "$daemon"
  done
}

setup() {
  cd "$BATS_TEST_TMPDIR" || return
  use here
}

# use MACHINE: the next requests go there.
use() { read -r url daemon <"$BATS_FILE_TMPDIR/$1.daemon"; }

# same PATH...: of the model uploaded last.
same() {
  local name path
  for path; do
    for name in "${machines[@]}"; do
      use "$name"
      get "/v1/models/$id$path"
      expect 200
      mv answer "$name"
    done
    for name in "${machines[@]}"; do
      cmp here "$name" || { echo "$path differs on $name"; return 1; }
    done
  done
  use here
}

@test "the machines differ in the instruction sets that are chosen at run time" {
  grep -q avx2 /proc/cpuinfo || skip "this one has no AVX2"
  printf '#include <stdio.h>\nint main(void) { puts(__builtin_cpu_supports("avx2") ? "avx2" : "none"); }\n' >cpu.c
  gcc -o cpu cpu.c
  machine avx2
  [ "$($TESTED_RUNNER ./cpu)" = avx2 ]
  machine sse2
  [ "$($TESTED_RUNNER ./cpu)" = none ]
}

@test "the writer's scenes of every kind" {
  for name in "${machines[@]}"; do diff -rq "$BATS_FILE_TMPDIR/here" "$BATS_FILE_TMPDIR/$name"; done
}

@test "surfaces of quads, n-gons and triangles by Catmull and Clark" {
  for file in octopus.obj cube.obj tank.json; do
    upload "$samples/$file"
    same "" "/surface.json?level=3" "/surface.glb?level=4" "/surface.glb?level=5&normals=none" \
      "/surface.glb?level=3&boundary=none" "/surface.glb?level=3&boundary=edge-only&limit=true" \
      "/surface.glb?level=0&limit=true" "/surface.glb?level=3&quads=auto&triangles=smooth" \
      "/surface.obj?level=2" "/surface.gltf?level=1"
  done
}

@test "surfaces by Loop, of every scene that the writer knows" {
  for file in "$BATS_FILE_TMPDIR"/here/*.glb; do
    [[ $file != *wide* ]] || continue
    upload "$file"
    same "/surface.glb?level=2"
    [[ $file == *ngon* ]] || same "/surface.glb?level=3&scheme=loop"
  done
}

# Valences from 3 to 40 round two poles; sharp and semi-sharp rings and meridians, a sharp corner, a border.
spindle() {
  awk -v n="$1" 'BEGIN {
    for (r = 0; r < 4; r++) for (i = 0; i < n; i++)
      print "v", (r + 1) * cos(i * 6.2832 / n), r * r * 0.3 + 0.1 * (i % 3), (r + 1) * sin(i * 6.2832 / n)
    print "v 0 -0.7 0"
    for (i = 0; i < n; i++) print "f", 4 * n + 1, i + 1, (i + 1) % n + 1
    for (r = 0; r < 3; r++) for (i = 0; i < n; i++)
      print "f", r * n + i + 1, (r + 1) * n + i + 1, (r + 1) * n + (i + 1) % n + 1, r * n + (i + 1) % n + 1
    for (i = 0; i < n; i++) print "t crease 2/1/0", n + i, n + (i + 1) % n, (i % 4 == 3 ? "10" : 0.7 * (i % 4))
    for (r = 0; r < 3; r++) print "t crease 2/1/0", r * n, r * n + n, 1.5 + r
    print "t corner 1/1/0", 2 * n + 1, "1.3"
  }'
}

@test "surfaces round creases and extraordinary points" {
  for valence in 3 5 6 7 12 40; do
    spindle $valence >spindle.obj
    upload spindle.obj
    same "/surface.glb?level=3" "/surface.glb?level=4&creasing=chaikin" "/surface.glb?level=2&limit=true" \
      "/surface.glb?level=1&boundary=none"
  done
}

@test "a clip in a surface, kept, taken at times and reduced" {
  upload "$samples/tank.json"
  same "/surface.glb?level=2&clip=drive" "/surface.glb?level=2&clip=drive&at=1.3" \
    "/surface.glb?level=1&clip=drive&fps=30&from=0&to=3" "/surface.glb?level=1&clip=drive&tolerance=0.01"
  upload "$BATS_FILE_TMPDIR/here/animated.glb"
  same "/surface.glb?level=2&clip=aim&at=0.7&skin=bake"
}

# Sixty tracks of forty keys, of each interpolation, seeded: quaternions all over, angles that wrap and angles
# that turn evenly.
turns() {
  awk 'function uniform() { seed = (seed * 16807) % 2147483647; return seed / 1073741823.5 - 1 }
  BEGIN {
    seed = 42
    printf "{\"nodes\":["
    for (i = 0; i < 60; i++)
      printf "%s{\"name\":\"n%d\"%s}", i ? "," : "", i, i % 5 ? sprintf(",\"parent\":\"n%d\"", i - 1) : ""
    printf "],\"clips\":[{\"name\":\"c\",\"tracks\":["
    split("slerp nlerp squad euler euler", kind, " ")
    for (i = 0; i < 60; i++) {
      printf "%s{\"node\":\"n%d\",\"path\":\"rotation\",\"interpolation\":\"%s\",\"times\":[", i ? "," : "", i, kind[i % 5 + 1]
      for (k = 0; k < 40; k++) printf "%s%.2f", k ? "," : "", k / 4
      printf i % 5 < 3 ? "],\"quaternions\":[" : "],\"unit\":\"degrees\",\"order\":\"YXZ\",\"eulers\":["
      for (k = 0; k < 40; k++) {
        if (i % 5 < 3) printf "%s[%.6f,%.6f,%.6f,%.6f]", k ? "," : "", uniform(), uniform(), uniform(), uniform()
        else if (i % 5 == 3) printf "%s[%.2f,%.2f,%.2f]", k ? "," : "", 400 * uniform(), 400 * uniform(), 400 * uniform()
        else printf "%s[0,%d,0]", k ? "," : "", 30 * k
      }
      printf "]}"
    }
    printf "]}]}"
  }'
}

@test "poses of each interpolation in each form" {
  turns >turns.json
  upload turns.json
  times="from=0&to=9.75&fps=60"
  for as in trs matrix euler axis-angle; do
    same "/pose.bin?$times&as=$as" "/pose.bin?$times&as=$as&space=world" "/pose.json?$times&as=$as&space=world"
  done
  same "/pose.csv?$times&as=euler&order=ZXY&unit=degrees" "/pose.ndjson?$times&loop=pingpong"
}

@test "what rotation tracks do" {
  turns >turns.json
  upload turns.json
  same "/tracks"
  upload "$samples/tank.json"
  same "/tracks?clip=drive"
}
