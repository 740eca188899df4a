# The program: flags and environment, the ready line, the health check, logs.

load helper
setup() {
  needs_process
  cd "$BATS_TEST_TMPDIR" || return
  tweend=${TESTED_BINARY:-$root/build/tweend}
}
teardown() { [[ -z ${daemon-} ]] || stop_daemon; }

@test "the ready line names the port that was taken" {
  start_daemon
  [[ $(cat "$ready") =~ ^tweend\ [0-9.]+\ listening\ on\ http://127\.0\.0\.1:[1-9][0-9]*$ ]]
  get /readyz
  expect 200
}

@test "bad flags and values are refused with one clear line that names them" {
  for arguments in --no-such-flag "--max-level 99" "--max-upload lots" "--listen nowhere" "--threads 0" \
    "--drain-timeout 1fortnight" "--max-level" "cube.obj" "--cache-dir /dev/null --data s3://bucket" \
    "--cache-dir /dev/null --data s3://bucket --check"; do
    # shellcheck disable=SC2086 # one word or two
    run timeout 10 "$tweend" --data "$PWD/data" $arguments
    [ "$status" -ne 0 ] && [ "$status" -ne 124 ]
    [ "${#lines[@]}" -eq 1 ] || { echo "$output"; return 1; }
    [[ $output == *"${arguments%% *}"* ]] || { echo "$output"; return 1; }
  done
}

# bats test_tags=plain
@test "threads that cannot be started are one clear line" {
  for flag in --threads --io-threads; do
    run bash -c "ulimit -v 3000000; exec timeout 20 '$tweend' --listen 127.0.0.1:0 --data '$PWD/data' $flag 1000"
    [ "$status" -eq 1 ]
    [[ ${lines[-1]} == *"$flag: cannot start"*1000*": "?* ]] || { echo "$output"; return 1; }
  done
}

@test "a port that is taken is one clear line" {
  start_daemon
  run timeout 10 "$tweend" --listen "${url#http://}" --data "$PWD/other"
  [ "$status" -ne 0 ] && [ "$status" -ne 124 ]
  [ "${#lines[@]}" -eq 1 ]
  [[ $output == *"${url#http://}"* ]]
}

@test "the health check asks the running daemon" {
  start_daemon
  address=${url#http://}
  run "$tweend" --healthcheck --listen "$address"
  [ "$status" -eq 0 ]
  stop_daemon
  run timeout 20 "$tweend" --healthcheck --listen "$address"
  [ "$status" -eq 1 ]
}

@test "it listens on a unix socket" {
  launch_line=$BATS_TEST_TMPDIR/unix.ready
  "$tweend" --listen "unix:$PWD/socket" --data "$PWD/data" >"$launch_line" 2>unix.log 3>&- &
  unix=$!
  for _ in $(seq 100); do [[ -s $launch_line ]] && break; sleep 0.1; done
  curl --silent --fail --unix-socket "$PWD/socket" http://localhost/readyz
  "$tweend" --healthcheck --listen "unix:$PWD/socket"
  kill -TERM "$unix"
  wait "$unix"
}

@test "with a certificate it speaks https" {
  command -v openssl >/dev/null || skip "needs openssl to make a certificate"
  openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext subjectAltName=IP:127.0.0.1 \
    -keyout key.pem -out cert.pem 2>/dev/null
  start_daemon --tls-cert cert.pem --tls-key key.pem
  [[ $url == https://* ]]
  get /readyz --cacert cert.pem
  expect 200
  get /readyz
  [ "$status" = 000 ]
}

# bats test_tags=plain
@test "server/run builds what is missing and serves the samples" {
  [[ -z ${TESTED_BINARY-} || $TESTED_BINARY -ef $root/build/tweend ]] || skip "looks at the tree's own build"
  export TWEEND_INSTALL=no
  launch "$root/server/run" --listen 127.0.0.1:0 --data "$PWD/data"
  [ "$(wc -l <"$ready")" = 1 ]
  get /v1/models
  holds '[.models[].format] | sort == ["obj", "obj", "tweend"]'
  for id in $(value '.models[].id'); do
    get "/v1/models/$id/surface.glb?level=2"
    expect 200
  done
}

@test "one line a request is logged, with its id" {
  start_daemon --log-format json
  get /version --header 'X-Request-Id: seen-in-the-log'
  stop_daemon
  [ "$(grep -c seen-in-the-log "$log")" = 1 ]
  grep seen-in-the-log "$log" | gojq -e '.status == 200 and (.method == "GET")'
}

@test "a log line cannot be forged by a request" {
  start_daemon
  get '/nothing%0aforged' --header 'X-Request-Id: a"b'
  stop_daemon
  if grep -q '^forged' "$log"; then false; fi
}

@test "API keys, once configured, are asked for" {
  start_daemon --api-keys secret-one,secret-two
  get /v1/models
  problem 401
  [ -n "$(header www-authenticate)" ]
  get /v1/models --header 'Authorization: Bearer wrong'
  [[ $status == 401 || $status == 403 ]]
  get /v1/models --header 'Authorization: Bearer secret-two'
  expect 200
  get /healthz
  expect 200
}

# until COMMAND...: waits for it to succeed.
until_it_holds() {
  local tries
  for ((tries = 0; tries < 100; tries++)); do
    if "$@"; then return 0; fi
    pause 0.1
  done
  return 1
}

key_is() { get /v1/models --header "Authorization: Bearer $1" && [ "$status" = "$2" ]; }

@test "SIGHUP reads the keys' file again, and keeps the keys when it cannot" {
  echo old >keys
  start_daemon --api-keys "@$PWD/keys"
  key_is old 200
  printf 'new\nother\n' >keys
  key_is new 403
  kill -HUP "$daemon"
  until_it_holds key_is new 200
  key_is other 200
  key_is old 403
  : >keys
  kill -HUP "$daemon"
  until_it_holds grep -q 'the API keys stay' "$log"
  key_is new 200
  rm keys
  kill -HUP "$daemon"
  until_it_holds grep -q "cannot read '$PWD/keys'" "$log"
  key_is new 200
}

logs_request() { get /version --header "X-Request-Id: $1" && sleep 0.1 && grep -q "$1" "$log"; }
logs_no_request() { ! logs_request "$1"; }

@test "SIGHUP reads the log level again" {
  echo warn >level
  start_daemon --log-level "@$PWD/level"
  logs_no_request first
  echo info >level
  kill -HUP "$daemon"
  until_it_holds logs_request second
  echo loud >level
  kill -HUP "$daemon"
  until_it_holds grep -q "'loud' is not" "$log"
  logs_request third
}

# certificate NAME
certificate() {
  openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj "/CN=$1" -addext subjectAltName=IP:127.0.0.1 \
    -keyout "$1.key" -out "$1.pem" 2>/dev/null
}

trusts() { get /readyz --cacert "$1.pem" && [ "$status" = 200 ]; }

@test "SIGHUP reads certificate and key again, and keeps them when they do not fit" {
  command -v openssl >/dev/null || skip "needs openssl to make certificates"
  certificate one
  certificate two
  cp one.pem cert.pem
  cp one.key key.pem
  start_daemon --tls-cert cert.pem --tls-key key.pem
  trusts one
  cp two.pem cert.pem
  kill -HUP "$daemon"
  until_it_holds grep -q 'the certificate stays' "$log"
  trusts one
  cp two.key key.pem
  kill -HUP "$daemon"
  until_it_holds trusts two
  run ! trusts one
}

@test "a certificate that is not the key's is refused at start" {
  command -v openssl >/dev/null || skip "needs openssl to make certificates"
  certificate one
  certificate two
  run timeout 10 "$tweend" --data "$PWD/data" --listen 127.0.0.1:0 --tls-cert one.pem --tls-key two.key
  [ "$status" -eq 1 ]
  [ "${#lines[@]}" -eq 1 ]
  [[ $output == *one.pem* ]]
}

@test "no signal but the last ones ends it without a drain" {
  start_daemon
  for signal in HUP USR1 USR2 ALRM PIPE VTALRM PROF IO PWR XCPU XFSZ STKFLT 34 64; do
    kill "-$signal" "$daemon"
    get /version
    expect 200
  done
  curl --silent --output slow.glb --limit-rate 1M --data-binary "@$samples/octopus.obj" "$url/v1/surface.glb?level=5" 3>&- &
  client=$!
  until_it_holds test -s slow.glb
  kill -QUIT "$daemon"
  wait "$client"
  wait "$daemon"
  daemon=""
  grep -q 'signal 3: draining' "$log"
}

@test "the manual page has every flag that --help has, and man has nothing to say about it" {
  "$tweend" --man >tweend.1
  MANWIDTH=200 man --warnings --local-file tweend.1 >page 2>warnings
  [ ! -s warnings ]
  "$tweend" --help | grep -oE '^  --[a-z-]+|TWEEND_[A-Z_]+' >names
  (($(wc -l <names) > 60))
  while read -r name; do grep -qF -- "$name" page || { echo "$name is missing"; false; }; done <names
  for title in NAME SYNOPSIS OPTIONS Signals systemd "Exit status"; do grep -q "^$title$" page; done
}

# bats test_tags=plain
@test "cmake --install brings the program, its manual page and its units" {
  [[ -z ${TESTED_BINARY-} || $TESTED_BINARY -ef $root/build/tweend ]] || skip "looks at the tree's own build"
  cmake --install "$root/build" --prefix "$PWD/installed" >install.log
  (cd installed && find . -type f | sort) >files
  diff files - <<'END'
./bin/tweend
./lib/systemd/system/tweend.service
./lib/systemd/system/tweend.socket
./share/man/man1/tweend.1
END
  "$tweend" --man | diff - installed/share/man/man1/tweend.1
}
