# Answers far larger than the daemon's memory, slow readers, readers that leave.
# bats file_tags=plain

load helper
setup_file() {
  [[ -z ${TESTED_URL-} ]] || return 0
  start_daemon
}
teardown_file() { stop_daemon; }
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
  upload "$samples/cube.obj"
  cube=/v1/models/$id
}

# memory WHAT: VmRSS or VmHWM of the daemon, in bytes.
memory() { awk -v what="$1:" '$1 == what { print $2 * 1024 }' "/proc/$daemon/status"; }

@test "a cube of 1.6 million faces streams from a tenth of its size" {
  get "$cube/surface.json?level=9"
  holds '.faces == 1572864 and .vertices == 1572866'
  bytes=$(value .bytes)
  seen=$(curl --silent --write-out '%{size_download}' --output /dev/null "$url$cube/surface.glb?level=9")
  [ "$seen" = "$bytes" ]
  peak=$(memory VmHWM)
  echo "# $bytes bytes sent, at most $peak bytes resident" >&3
  ((peak * 10 < bytes || peak < 24000000))
}

@test "a million poses need no more memory than a thousand" {
  start_daemon # one whose memory nothing else has touched
  upload "$samples/tank.json"
  curl --silent --output /dev/null "$url/v1/models/$id/pose.bin?from=0&to=4&fps=250"
  before=$(memory VmHWM)
  for form in bin ndjson; do
    curl --silent --write-out '%{size_download}\n' --output /dev/null "$url/v1/models/$id/pose.$form?from=0&to=3.99999&fps=250000"
  done >sizes
  after=$(memory VmHWM)
  echo "# $(paste -sd + sizes) bytes sent, $((after - before)) more resident" >&3
  stop_daemon
  (($(head -n 1 sizes) > 360000000 && $(tail -n 1 sizes) > 360000000))
  ((after - before < 4000000))
}

@test "four readers at once need a third of one answer" {
  get "$cube/surface.json?level=9"
  bytes=$(value .bytes)
  clients=()
  for i in 1 2 3 4; do
    curl --silent --output "answer$i" "$url$cube/surface.glb?level=9" 3>&- &
    clients+=($!)
  done
  wait "${clients[@]}"
  for i in 1 2 3 4; do
    [ "$(stat -c %s "answer$i")" = "$bytes" ]
    cmp answer1 "answer$i"
  done
  echo "# $bytes bytes each, at most $(memory VmHWM) resident" >&3
  (($(memory VmHWM) * 3 < bytes))
}

@test "a slow reader costs no processor time" {
  curl --silent --output /dev/null --limit-rate 1M --max-time 4 "$url$cube/surface.glb?level=9" 3>&- &
  client=$!
  sleep 1
  ticks() { awk '{ print $14 + $15 }' "/proc/$daemon/stat"; }
  before=$(ticks)
  sleep 2
  spent=$(($(ticks) - before))
  kill "$client" 2>/dev/null || true
  wait "$client" || true
  # A fifth of one core's two seconds would be 40 ticks.
  ((spent < 40))
}

@test "readers that leave in the middle leave nothing behind" {
  get /healthz
  before=$(find "/proc/$daemon/fd" -type l | wc -l)
  for _ in $(seq 20); do
    curl --silent --output /dev/null --max-time 0.1 "$url$cube/surface.glb?level=9" || true
  done
  pause 0.5
  get /healthz
  expect 200
  after=$(find "/proc/$daemon/fd" -type l | wc -l)
  ((after <= before + 2))
}

@test "the first byte does not wait for the last" {
  get "$cube/surface.glb?level=5"
  times=$(curl --silent --output /dev/null --write-out '%{time_starttransfer} %{time_total}' "$url$cube/surface.obj?level=9")
  echo "# OBJ of level 9: first byte after ${times% *} s, last after ${times#* } s" >&3
  awk '{ exit !($1 < $2 / 2) }' <<<"$times"
}
