# Many clients at once: equal questions have equal answers, and nothing gets lost.

load helper
# All sixteen clients wait for their turn: the full queue has a case of its own below.
setup_file() { start_daemon --queue 64; }
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# together COUNT PATH...: asks for each path COUNT times, eight at a time: two threads and their queue hold
# as many. Answers in out-N-I.
together() {
  local count=$1 i n=0 path
  shift
  for path in "$@"; do
    n=$((n + 1))
    for ((i = 0; i < count; i++)); do printf 'url = "%s%s"\noutput = "out-%d-%d"\n' "$url" "$path" "$n" "$i"; done
  done >requests
  curl --silent --fail --globoff --parallel --parallel-immediate --parallel-max 8 --config requests
}

# identical N COUNT
identical() {
  local i
  for ((i = 1; i < $2; i++)); do cmp "out-$1-0" "out-$1-$i"; done
}

@test "clients asking for the same new surface at once get the same bytes" {
  { cat "$samples/octopus.obj"; echo "# $RANDOM$RANDOM"; } >new.obj
  upload new.obj
  together 16 "/v1/models/$id/surface.glb?level=3"
  identical 1 16
}

@test "surfaces, poses, descriptions and lists, all at once" {
  upload "$samples/octopus.obj"
  octopus=/v1/models/$id
  upload "$samples/tank.json"
  tank=/v1/models/$id
  together 8 "$octopus/surface.glb?level=2" "$octopus/surface.obj?level=1" "$octopus/surface.json?level=7" \
    "$octopus" "$tank" "$tank/pose.json?from=0&to=4&fps=30" "$tank/surface.glb?level=1&clip=drive&at=1" \
    "$octopus/source" /version
  for n in 1 2 3 4 5 6 7 8 9; do identical $n 8; done
}

@test "large surfaces at once, while other readers leave" {
  upload "$samples/cube.obj"
  cube=/v1/models/$id
  for _ in $(seq 6); do
    curl --silent --output /dev/null --max-time 0.05 "$url$cube/surface.glb?level=9" 3>&- &
  done
  together 3 "$cube/surface.glb?level=7" "$cube/surface.glb?level=7&normals=none" "$cube/surface.gltf?level=6"
  for n in 1 2 3; do identical "$n" 3; done
  wait $(jobs -p | grep -vx "${daemon:-0}") || true
}

@test "racing uploads of the same bytes make one model" {
  { cat "$samples/cube.obj"; echo "# $RANDOM$RANDOM"; } >same.obj
  for i in $(seq 8); do
    curl --silent --output "same-$i" --write-out '%{http_code}\n' --data-binary @same.obj "$url/v1/models" 3>&- >"code-$i" &
  done
  wait $(jobs -p | grep -vx "${daemon:-0}")
  cat code-* | sort | uniq -c >codes
  [ "$(awk '$2 == 201 { print $1 }' codes)" = 1 ]
  [ "$(awk '$2 == 200 { print $1 }' codes)" = 7 ]
  [ "$(gojq -r .id same-* | sort -u | wc -l)" = 1 ]
}

@test "uploads and deletions race without a broken answer" {
  { cat "$samples/cube.obj"; echo "# $RANDOM$RANDOM"; } >racing.obj
  id=$(sha256sum racing.obj | head -c 32)
  for i in $(seq 30); do
    curl --silent --output /dev/null --write-out '%{http_code}\n' --data-binary @racing.obj "$url/v1/models" 3>&- >"up-$i" &
    curl --silent --output /dev/null --write-out '%{http_code}\n' --request DELETE "$url/v1/models/$id" 3>&- >"down-$i" &
    curl --silent --output /dev/null --write-out '%{http_code}\n' "$url/v1/models/$id/surface.glb" 3>&- >"get-$i" &
    ((i % 5)) || wait $(jobs -p | grep -vx "${daemon:-0}")
  done
  wait $(jobs -p | grep -vx "${daemon:-0}")
  cat up-* | sort -u | grep -vxE '200|201' >odd || true
  cat down-* | sort -u | grep -vxE '204|404' >>odd || true
  cat get-* | sort -u | grep -vxE '200|404' >>odd || true
  [ ! -s odd ] || { cat odd; false; }
}

@test "a full queue answers 503 at once, with the time to come again" {
  needs_process
  (
    start_daemon --threads 1 --queue 1 --compute-timeout 10m
    trap stop_daemon EXIT
    grid "$([[ -n ${TESTED_SANITIZED-} ]] && echo 200 || echo 500)" >large.obj
    clients=()
    for i in $(seq 24); do
      curl --silent --output /dev/null --max-time 600 --write-out '%{http_code}\n' --dump-header "head-$i" \
        --header 'Expect:' --data-binary @large.obj "$url/v1/surface.json" 3>&- >"code-$i" &
      clients+=($!)
    done
    wait "${clients[@]}"
    cat code-* | sort | uniq -c
    [ "$(cat code-* | grep -cvxE '200|503')" = 0 ]
    [ "$(cat code-* | grep -cx 200)" -ge 1 ]
    [ "$(cat code-* | grep -cx 503)" -ge 1 ]
    for i in $(seq 24); do
      [ "$(cat "code-$i")" != 503 ] || grep -qi '^retry-after: [1-9]' "head-$i"
    done
    get /readyz
    expect 200
  )
}

@test "clients that do everything at once in little memory leave nothing behind" {
  needs_process
  (
    start_daemon --max-memory 32MiB --plan-cache 1MiB --queue 4 --threads 4 --io-threads 2
    trap stop_daemon EXIT
    node "$BATS_TEST_DIRNAME/mixed.mjs" "$url"
    get /readyz
    expect 200
  )
}
