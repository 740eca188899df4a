# The end: SIGTERM lets what is under way finish, and takes nothing new.

load helper
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
  start_daemon --drain-timeout 2m --compute-timeout 10m # which counts time, and machines are busy
}
teardown() { [[ -z ${daemon-} ]] || stop_daemon; }

@test "SIGTERM: an answer under way comes to its end, the daemon ends with 0" {
  upload "$samples/cube.obj"
  get "/v1/models/$id/surface.json?level=9"
  bytes=$(value .bytes)
  curl --silent --output slow.glb --limit-rate 20M "$url/v1/models/$id/surface.glb?level=9" 3>&- &
  client=$!
  pause 0.7
  kill -0 "$client"
  kill -TERM "$daemon"
  wait "$client"
  [ "$(stat -c %s slow.glb)" = "$bytes" ]
  wait "$daemon"
  daemon=""
}

# Sockets of the daemon's port whose clients have not taken all: what the kernel still holds of answers.
unsent() {
  awk -v port="$(printf ':%04X' "${url##*:}")" '$2 ~ port "$" && $5 !~ /^00000000:/' /proc/net/tcp | wc -l
}

@test "an answer is done when its client has it: nothing is left to the kernel at the end" {
  upload "$samples/cube.obj"
  get "/v1/models/$id/surface.json?level=6"
  bytes=$(value .bytes)
  IFS=: read -r host port <<<"${url#http://}"
  exec 9<>"/dev/tcp/$host/$port"
  printf 'GET /v1/models/%s/surface.glb?level=6 HTTP/1.1\r\nHost: localhost\r\n\r\n' "$id" >&9
  sleep 1 # the daemon has sent all by now, the client read nothing
  { sleep 1.5; cat <&9 >answer; } 3>&- &
  client=$!
  [ "$(unsent)" = 1 ]
  kill -TERM "$daemon"
  wait "$daemon"
  daemon=""
  [ "$(unsent)" = 0 ]
  exec 9>&-
  wait "$client"
  [ "$(stat -c %s answer)" -gt "$bytes" ]
}

@test "while draining, new requests are refused: 503 or no connection" {
  upload "$samples/cube.obj"
  curl --silent --output slow.glb --limit-rate 2M "$url/v1/models/$id/surface.glb?level=9" 3>&- &
  client=$!
  pause 0.7
  kill -TERM "$daemon"
  pause 0.3
  for path in /readyz /v1/models; do
    get "$path" --max-time 3
    [[ $status == 503 || $status == 000 ]]
    [[ $status == 000 || -n $(header retry-after) ]]
  done
  kill "$client"
  wait "$client" || true
  wait "$daemon"
  daemon=""
}

@test "SIGINT ends it too" {
  kill -INT "$daemon"
  wait "$daemon"
  daemon=""
}

@test "without a request it ends at once" {
  started=$EPOCHSECONDS
  stop_daemon
  ((EPOCHSECONDS - started <= 10))
}

@test "the drain has an end: a client that never reads is cut off" {
  stop_daemon
  start_daemon --drain-timeout 1s
  upload "$samples/cube.obj"
  curl --silent --output slow.glb --limit-rate 10k "$url/v1/models/$id/surface.glb?level=9" 3>&- &
  client=$!
  pause 0.5
  started=$EPOCHSECONDS
  kill -TERM "$daemon"
  wait "$daemon" || true
  daemon=""
  ((EPOCHSECONDS - started <= 10))
  # What the kernel still holds for it would take the client minutes.
  kill "$client" || true
  wait "$client" || true
}
