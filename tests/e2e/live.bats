# Live poses over the wire: in time, resumable, skipping for slow readers, ended by a drain.

load helper
setup_file() {
  start_daemon
  cd "$BATS_FILE_TMPDIR" || return
  upload "$samples/tank.json"
  export tank=/v1/models/$id
}
teardown_file() { stop_daemon; }
setup() { cd "$BATS_TEST_TMPDIR" || return; }

# stream QUERY [CURL ARGUMENT...]: the whole stream into the file events.
stream() { curl --silent --show-error --no-buffer --output events "$url$tank/live?$1" "${@:2}"; }

ids() { sed -n 's/^id: //p' events; }

# await_events FILE COUNT: until so many events have come.
await_events() {
  local tries
  for ((tries = 0; tries < 300; tries++)); do
    [[ ! -f $1 ]] || (($(grep -c '^id: ' "$1") < $2)) || return 0
    sleep 0.1
  done
  return 1
}

# counter NAME: of /metrics.
counter() { curl --silent "$url/metrics" | awk -v name="tweend_live_$1" '$1 == name { print $2 }'; }

@test "a clip plays in its own time and ends with the event end" {
  started=$EPOCHREALTIME
  stream 'speed=2&fps=20&nodes=turret'
  took=$(awk -v a="$started" -v b="$EPOCHREALTIME" 'BEGIN { print b - a }')
  # 4 seconds of clip at twice the speed.
  awk -v took="$took" 'BEGIN { exit !(took >= 1.99 && took < 10) }'
  [ "$(ids | head -n 1)" = 0 ]
  [ "$(ids | tail -n 1)" = 40 ]
  ids | sort --numeric-sort --unique --check
  [ "$(tail -n 3 events | head -n 2)" = $'event: end\ndata: {}' ]
}

@test "each event is the pose that pose.ndjson gives" {
  stream 'speed=4&fps=5&as=matrix&space=world'
  get "$tank/pose.ndjson?from=0&to=4&fps=1.25&as=matrix&space=world"
  sed -n 's/^data: {"t/{"t/p' events >poses
  # On a busy machine frames may be left out, but not the last.
  [ "$(tail -n 1 poses)" = "$(tail -n 1 answer)" ]
  if grep --fixed-strings --line-regexp --invert-match --file answer poses; then false; fi
}

@test "frames keep to their time: no drift in ten seconds at 60 a second" {
  # A line a frame, with the time at which it was read; awk's own clock has whole seconds only.
  curl --silent --no-buffer --max-time 11 "$url$tank/live?fps=60&loop=repeat&nodes=turret" |
    while IFS= read -r line; do
      [[ $line != id:* ]] || echo "${line#id: } $EPOCHREALTIME"
    done >arrivals || true
  # The least delay in the first and the last quarter: what the machine's other work did not touch.
  awk '{ late = $2 - $1 / 60; part = $1 < 150 ? 1 : $1 >= 450 ? 2 : 0; if (!(part in least) || late < least[part]) least[part] = late }
    END { if (NR < 100) exit 1; drift = least[2] - least[1]; printf "# %d frames, drift %.2f ms\n", NR, drift * 1000 > "/dev/stderr"
          exit !(drift < 1 / 60 && drift > -1 / 60) }' arrivals 2>&3
}

@test "Last-Event-ID goes on behind it, at the end there is nothing more" {
  stream 'fps=10&speed=4' --header 'Last-Event-ID: 7'
  [ "$(ids | head -n 1)" = 8 ]
  [ "$(ids | tail -n 1)" = 10 ]
  get "$tank/live?fps=10&speed=4" --header 'Last-Event-ID: 10'
  expect 204
}

@test "a looping stream is joined where it is, or begins where from says" {
  curl --silent --no-buffer --max-time 60 --output first "$url$tank/live?fps=50&loop=repeat&nodes=hull" 3>&- &
  client=$!
  await_events first 40
  stream 'fps=50&loop=repeat&nodes=hull' --max-time 2 || true
  (($(ids | head -n 1) >= 40))
  stream 'fps=50&loop=repeat&nodes=hull&from=1' --max-time 2 || true
  [ "$(ids | head -n 1)" = 0 ]
  grep -q '^data: {"t":1,' events
  kill "$client"
  wait "$client" || true
}

@test "a hundred listeners cost one evaluation a frame" {
  before=$(counter frames_printed_total)
  clients=()
  for i in $(seq 100); do
    curl --silent --no-buffer --max-time 4 --output "many$i" "$url$tank/live?fps=20&loop=repeat" 3>&- &
    clients+=($!)
  done
  wait "${clients[@]}" || true
  after=$(counter frames_printed_total)
  echo "# $((after - before)) frames printed, $(cat many* | grep -c '^id: ') received" >&3
  ((after - before <= 20 * 20)) # 4 seconds each, opened within some seconds
  (($(cat many* | grep -c '^id: ') > 100 * 20))
}

@test "a slow reader skips frames, a quick one beside it gets all" {
  needs_plain_build
  # Frames so large that the buffers on the way hold few of them.
  awk 'BEGIN {
    printf "{\"nodes\":[{\"name\":\"n0\"}"
    for (i = 1; i < 4000; i++) printf ",{\"name\":\"n%d\",\"translation\":[0.1234567,%d,0.7654321]}", i, i
    printf "],\"clips\":[{\"tracks\":[{\"node\":\"n0\",\"path\":\"translation\",\"times\":[0,1],\"values\":[[0,0,0],[1,1,1]]}]}]}"
  }' >wide.json
  upload wide.json
  tank=/v1/models/$id
  before=$(counter frames_skipped_total)
  curl --silent --no-buffer --limit-rate 1M --max-time 6 --output slow "$url$tank/live?fps=30&loop=repeat" 3>&- &
  client=$!
  stream 'fps=30&loop=repeat' --max-time 5 || true
  wait "$client" || true
  skipped=$(($(counter frames_skipped_total) - before))
  echo "# quick $(ids | wc -l), slow $(grep -c '^id: ' slow), $skipped skipped" >&3
  (($(ids | wc -l) > 50 && $(ids | wc -l) > $(grep -c '^id: ' slow)))
  ((skipped > 30))
}

@test "HEAD, CORS and caching are those of a stream" {
  http HEAD "$tank/live"
  expect 200
  [ "$(header content-type)" = text/event-stream ]
  [ "$(header cache-control)" = no-store ]
  [ "$(header access-control-allow-origin)" = '*' ]
}

@test "a drain ends streams at once, without the event end" {
  needs_process
  start_daemon
  upload "$samples/tank.json"
  curl --silent --no-buffer --output events "$url/v1/models/$id/live?fps=20&loop=repeat" 3>&- &
  client=$!
  await_events events 2
  started=$EPOCHSECONDS
  stop_daemon
  ((EPOCHSECONDS - started <= 10))
  wait "$client"
  [ "$(grep -c 'event: end' events)" = 0 ]
}
