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
    pause 0.1
  done
  return 1
}

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

@test "Last-Event-ID goes on behind it, at the end there is nothing more" {
  stream 'fps=10&speed=4' --header 'Last-Event-ID: 7'
  [ "$(ids | head -n 1)" = 8 ]
  [ "$(ids | tail -n 1)" = 10 ]
  get "$tank/live?fps=10&speed=4" --header 'Last-Event-ID: 10'
  expect 204
}

@test "events bear the time, and those of one start are in phase" {
  start=$((${EPOCHREALTIME/./} / 1000 - 60000))
  for file in one two; do
    curl --silent --no-buffer --output $file "$url$tank/live?fps=4&loop=repeat&nodes=hull&start=$start" 3>&- &
    await_events $file 6
    kill $!
  done
  # Frame n is sent when it is due, or later on a busy machine; the first one is under way when the stream begins.
  for file in one two; do
    paste <(sed -n 's/^id: //p' $file) <(sed -n 's/^data: //p' $file | gojq .now) >sent
    awk -v start="$start" 'NR > 1 { late = $2 - start - $1 * 250; if (NR == 2 || late < least) least = late }
                           END { exit !(NR >= 4 && least >= -1 && least < 100) }' sent
  done
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
