# What operators set: rates and connections by address, the listener for probes, the drain, checks of settings.

load helper
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
}
teardown() { stop_daemon; }

program=${TESTED_BINARY:-$root/build/tweend}

@test "an address over --rate-limit is 429, and probes are not" {
  start_daemon --rate-limit 2/m
  for left in 1 0; do
    get /v1/models
    expect 200
    [[ $(header ratelimit) == "\"address\";r=$left;t="* && $(header ratelimit-policy) == '"address";q=2;w=60' ]]
  done
  get /v1/models
  problem 429 address
  (($(header retry-after) >= 1 && $(header retry-after) <= 30))
  post /v1/models "$samples/cube.obj"
  problem 429
  get /healthz
  expect 200
}

@test "X-Forwarded-For counts from trusted proxies alone" {
  start_daemon --rate-limit 1/h
  get /v1/models --header 'X-Forwarded-For: 192.0.2.1'
  expect 200
  get /v1/models --header 'X-Forwarded-For: 192.0.2.2'
  problem 429
  stop_daemon
  start_daemon --rate-limit 1/h --trusted-proxies 127.0.0.0/8
  get /v1/models --header 'X-Forwarded-For: 192.0.2.1'
  expect 200
  get /v1/models --header 'X-Forwarded-For: 192.0.2.2'
  expect 200
  get /v1/models --header 'X-Forwarded-For: 192.0.2.7' --header 'X-Forwarded-For: 192.0.2.2'
  problem 429
  get /v1/models --header 'X-Forwarded-For: 192.0.2.9, 192.0.2.1'
  problem 429
  grep -q '"peer":"192.0.2.2"' "$log"
}

@test "an address has --max-connections-per-address connections" {
  start_daemon --max-connections-per-address 2
  address=${url#http://}
  exec {one}<>"/dev/tcp/${address%:*}/${address#*:}" {two}<>"/dev/tcp/${address%:*}/${address#*:}"
  get /version
  expect 503
  exec {one}>&-
  for ((tries = 0; tries < 50; tries++)); do
    get /version
    [[ $status != 200 ]] || break
    pause 0.1
  done
  expect 200
  exec {two}>&-
}

@test "--admin-listen has probes and metrics without a key, and nothing else" {
  start_daemon --api-keys secret --admin-listen 127.0.0.1:0 --max-connections 1
  main=$url url=$(admin_url)
  for path in /healthz /readyz /version /metrics; do
    get "$path"
    expect 200
  done
  for path in /v1/models / /tweend.js; do
    get "$path" --header 'X-API-Key: secret'
    problem 404 listener
  done
  post /v1/surface.json "$samples/cube.obj" --header 'X-API-Key: secret'
  problem 404
  address=${main#http://}
  exec {one}<>"/dev/tcp/${address%:*}/${address#*:}"
  get /metrics
  expect 200
  exec {one}>&-
}

@test "--drain-delay answers 503 at /readyz, and everything else as before" {
  start_daemon --drain-delay 10s
  upload "$samples/cube.obj"
  kill -TERM "$daemon"
  for ((tries = 0; tries < 50; tries++)); do
    get /readyz
    [[ $status != 503 ]] || break
    pause 0.02
  done
  problem 503 draining
  get "/v1/models/$id/surface.glb"
  expect 200
  wait "$daemon"
  daemon=""
}

# would_not_start PATTERN FLAG...: --check says so in one line that matches.
would_not_start() {
  TWEEND_LISTEN=127.0.0.1:0 run -1 "$program" --check "${@:2}" # the default's port may be in use
  [[ ${#lines[@]} == 1 && $output == *"$1"* ]] || { echo "$output"; false; }
}

@test "--check tells whether the daemon would start, and leaves nothing behind" {
  run -0 "$program" --check --data "$PWD/a/b" --api-keys one,two --listen "unix:$PWD/socket" --admin-listen 127.0.0.1:0
  [[ $output == "the daemon would start"* && ! -e a && ! -e socket ]]
  touch file
  mkdir sealed
  chmod 500 sealed
  would_not_start "$PWD/none" --data "$PWD/a" --api-keys @"$PWD/none"
  would_not_start "$PWD/none" --data "$PWD/a" --api-keys one --url-keys @"$PWD/none"
  printf 'key everything\n' >keys
  would_not_start 'line 1' --data "$PWD/a" --api-keys @"$PWD/keys"
  would_not_start --data --data "$PWD/file/below"
  would_not_start "longer than" --data "$(printf '/%04000d' 0)"
  would_not_start "--tls-cert: 'file'" --tls-cert file --tls-key file
  would_not_start "--tls-cert: cannot read" --tls-cert none --tls-key file
  would_not_start 10.0.0.0/64 --trusted-proxies 10.0.0.0/64
  if [[ $EUID != 0 ]]; then would_not_start --data --data "$PWD/sealed/below"; fi
  run -2 "$program" --check --max-level 99
  run -2 "$program" --check --listen nowhere
  [[ $output == "tweend: --listen: 'nowhere'"* ]]
  run -2 "$program" --check --admin-listen nowhere
  [[ $output == "tweend: --admin-listen: 'nowhere'"* ]]
  run -2 "$program" --check --log-level "@$PWD/none"
  run -2 "$program" --check --tls-cert file
}

@test "--check looks at addresses without listening" {
  would_not_start "192.0.2.1:80" --listen 192.0.2.1:80
  would_not_start "192.0.2.1:81" --admin-listen 192.0.2.1:81
  would_not_start "$PWD/none/socket" --listen "unix:$PWD/none/socket"
  touch file
  would_not_start "$PWD/file" --listen "unix:$PWD/file"
  start_daemon
  run -0 "$program" --check --data "$data" --listen "${url#http://}"
  [[ ${lines[0]} == "$url is in use at present"* && ${lines[1]} == "the daemon would start"* ]]
}

@test "--check looks at what systemd sets" {
  WATCHDOG_USEC=often would_not_start "WATCHDOG_USEC: 'often'"
  NOTIFY_SOCKET=nowhere would_not_start "NOTIFY_SOCKET: 'nowhere'"
  NOTIFY_SOCKET=@there WATCHDOG_USEC=1000000 run -0 "$program" --check
}

@test "an unknown flag is refused before anything is built or opened" {
  run -2 "$program" --data "$PWD/new" --sampel
  [[ $output == *--sample* && ! -e new ]]
  for flag in --sampel -x --listne=127.0.0.1:0; do
    PATH=/usr/bin:/bin TWEEND_INSTALL=no CMAKE_GENERATOR=none run -2 "$root/server/run" "$flag"
    [[ ${#lines[@]} == 1 && $output == *"unknown argument '$flag'"* ]]
  done
}

@test "a variable that is no setting is warned of, with the nearest, and starts the daemon nevertheless" {
  TWEEND_PORT=tcp://10.0.0.1:80 TWEEND_MAX_UPLAOD=1 TWEEND_MAX_LEVEL=3 start_daemon
  [ "$(grep -c 'TWEEND_PORT is no setting' "$log")" = 1 ]
  grep -q 'TWEEND_MAX_UPLAOD is no setting; the nearest is TWEEND_MAX_UPLOAD' "$log"
  if grep -q 'TWEEND_MAX_LEVEL is no' "$log"; then false; fi
  TWEEND_MAX_UPLAOD=1 run -0 "$program" --check --data "$PWD/a"
  [[ $output == *"TWEEND_MAX_UPLAOD is no setting"*"the daemon would start"* ]]
}

@test "--data makes the folders on the way, and no folder where a file lies" {
  launch "$program" --listen 127.0.0.1:0 --data "$PWD/one/two/three"
  [ -d one/two/three/objects ]
  stop_daemon
  touch file
  run --separate-stderr -1 "$program" --listen 127.0.0.1:0 --data "$PWD/file/two"
  [[ $stderr == *"$PWD/file/two"* ]]
}

@test "-h prints what --help does" {
  [ "$("$program" -h)" = "$("$program" --help)" ]
  "$program" -h | grep -q -- --listen
  run --separate-stderr -2 "$program" -H
  [[ $stderr == *"unknown argument '-H'"* ]]
}

@test "--listen takes a name" {
  port=$(free_port)
  launch "$program" --listen "localhost:$port" --data "$PWD/data"
  get /healthz
  expect 200
}

@test "a line of the log tells route, stages and the trace that the request is part of" {
  start_daemon --log-format json
  upload "$samples/cube.obj"
  trace=00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01
  get "/v1/models/$id/surface.glb" --header "traceparent: $trace"
  get /version --header 'traceparent: 00-0AF7651916CD43DD8448EB211C80319C-b7ad6b7169203331-01'
  get /version --header "traceparent: $trace-more"
  stop_daemon
  grep '"message":"request"' "$log" | gojq --slurp . >lines
  holds '.[1] | .route == "/v1/models/{id}/surface" and .status == 200 and .bytes_out > 0' lines
  holds ".[1].traceparent == \"$trace\" and .[2].traceparent == null and .[3].traceparent == null" lines
  holds 'all(.[]; .receive_ms >= 0 and .queue_ms >= 0 and .work_ms >= 0 and .total_ms >= 0)' lines
}

@test "metrics tell of the process and of the queue" {
  start_daemon --threads 3 --queue 5
  get /metrics
  expect 200
  grep -qx 'tweend_compute_threads 3' answer
  grep -qx 'tweend_queue_capacity 5' answer
  for name in process_cpu_seconds_total process_open_fds process_max_fds process_start_time_seconds \
    process_resident_memory_bytes; do
    grep -qE "^$name [1-9]|^$name 0\.[0-9]*[1-9]" answer
  done
}

@test "threads are as many as the processors that the daemon may use" {
  data=$BATS_TEST_TMPDIR/data
  # shellcheck disable=SC2086 # the runner may have arguments
  launch taskset --cpu-list "$(taskset --cpu-list --pid $$ | grep -oE '[0-9]+$')" \
    ${TESTED_RUNNER-} "$program" --listen 127.0.0.1:0 --data "$data"
  get /metrics
  grep -qx "tweend_compute_threads 1" answer
  grep -qx "tweend_io_threads 1" answer
}

@test "threads are as many as the quota of the group of processes pays for" {
  limit_group cpu cpu.cfs_quota_us=100000 'cpu.max=100000 100000' # one processor
  start_daemon
  get /metrics
  grep -qx "tweend_compute_threads 1" answer
  grep -qx "tweend_io_threads 1" answer
}

@test "pages of other origins can read why the daemon itself refuses" {
  start_daemon --rate-limit 1/h
  get /v1/models/00112233445566778899aabbccddeeff --header 'Origin: https://far.example'
  get /v1/models/00112233445566778899aabbccddeeff --header 'Origin: https://far.example'
  problem 429
  [[ $(header access-control-allow-origin) == '*' && -n $(header retry-after) ]]
}

# bats test_tags=plain
@test "an answer that takes longer than --compute-timeout is cut off or refused, and the daemon goes on" {
  start_daemon --compute-timeout 500ms
  upload "$samples/octopus.obj"
  get "/v1/models/$id/surface.glb?level=2"
  expect 200
  run curl --silent --max-time 60 --output /dev/null --write-out '%{http_code}' "$url/v1/models/$id/surface.glb?level=7&encoding=meshopt"
  [[ $status == 18 || $output == 503 ]]
  get "/v1/models/$id/surface.glb?level=2"
  expect 200
}

# bats test_tags=plain
@test "edits and ways back to a cage end at --compute-timeout" {
  start_daemon
  shape='"shape": {"kind": "grid", "segments": [200, 200]}'
  printf '{"meshes": [{%s}]}' "$shape" >grid.json
  upload grid.json
  grid=$id
  post "/v1/surface.obj?level=1" grid.json
  cp answer refined.obj
  upload refined.obj
  refined=$id
  smooth=$(printf '{"edit": "smooth", "iterations": 100},%.0s' 1 2 3 4)
  printf '{"meshes": [{%s, "edits": [%s]}]}' "$shape" "${smooth%,}" >smooth.json
  printf '{"edits": [%s]}' "${smooth%,}" >edits.json
  stop_daemon
  start_daemon --compute-timeout 20ms
  post "/v1/models/$grid/edits" edits.json --header 'Content-Type: application/json'
  problem 503
  holds '.detail | contains("longer than the daemon allows")'
  post /v1/models smooth.json
  problem 503
  http POST "/v1/models/$refined/coarsen"
  problem 503
}

@test "an error that repeats fills no log: the lines that are left out are counted" {
  start_daemon --log-format json
  rm -rf "$data"
  curl --silent --output /dev/null "$url/v1/models?limit=[1-60]"
  sleep 1.1
  get /v1/models
  problem 503
  stop_daemon
  written=$(grep -c 'cannot find the folder' "$log")
  hidden=$(sed -n 's/.*"message":"\([0-9]*\) more of these, the last: store: cannot find.*/\1/p' "$log" | awk '{ n += $1 } END { print n }')
  ((written <= 50 && written + hidden >= 61)) || { echo "$written lines, $hidden left out"; false; }
}

# heavy: becomes a client whose request computes for half a minute, until the client leaves.
heavy() {
  local shape='{"kind":"grid","size":[1,1],"segments":[500,500]}' edits='[{"edit":"fill","method":"fair"}]'
  exec curl --silent --output /dev/null --header 'Content-Type: application/json' \
    --data "{\"meshes\":[{\"shape\":$shape,\"edits\":$edits}]}" "$url/v1/surface.json?level=0"
}

# busy COUNT: before long so many threads compute.
busy() {
  local tries
  for ((tries = 0; tries < 200; tries++)); do
    ! curl --silent "$url/metrics" | grep -qx "tweend_compute_threads_busy $1" || return 0
    pause 0.05
  done
  curl --silent "$url/metrics" | grep tweend_compute_threads_busy
  return 1
}

# bats test_tags=plain
@test "what nobody waits for any more is not computed, and long requests keep no short one waiting" {
  needs_process
  start_daemon --threads 1 --queue 4 --max-memory 16GiB # what an edit may take is bounded far above what it takes
  heavies=()
  for _ in 1 2 3; do
    heavy 3>&- &
    heavies+=($!)
  done
  busy 3
  http POST "/v1/surface.glb?level=1" --max-time 10 --data-binary "@$samples/cube.obj"
  expect 200
  kill "${heavies[@]}"
  wait "${heavies[@]}" || true
  busy 0
}
