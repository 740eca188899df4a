# Sockets that systemd passes, what it is told, and the units. systemd-socket-activate passes sockets as the service
# manager does, and runs without one.

# shellcheck disable=SC2154 # the helper sets them
load ../e2e/helper

program=${TESTED_BINARY:-$root/build/tweend}

setup() {
  needs_process
  command -v systemd-socket-activate >/dev/null || skip "systemd is not installed"
  cd "$BATS_TEST_TMPDIR" || return
}

teardown() {
  stop_daemon
  [[ -z ${listener-} ]] || kill "$listener"
  [[ ! -f pids ]] || xargs kill <pids 2>/dev/null || true # where the test failed
}

# activate OPTION... -- FLAG...: the daemon on passed sockets. It is started by its first connection, to $knock.
activate() {
  local options=()
  while [[ $1 != -- ]]; do options+=("$1") && shift; done
  shift
  {
    curl --silent --output /dev/null --max-time 20 --retry 50 --retry-delay 1 --retry-connrefused "http://$knock/healthz"
  } 3>&- &
  launch systemd-socket-activate "${options[@]}" "$program" --data "$PWD/data" "$@"
}

# hear ADDRESS: writes what is told there, a line each, to the file told. @NAME is an abstract address.
hear() {
  python3 - "$1" >told 3>&- <<'END' &
import socket, sys
s = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
s.bind(sys.argv[1].replace('@', '\0', 1))
print('hears', flush=True)
while True:
    print(s.recv(4096).decode(), flush=True)
END
  listener=$!
  until_told hears
}

# has FILE COUNT PATTERN: waits until so many lines match.
has() {
  local tries
  for ((tries = 0; tries < 100; tries++)); do
    [[ ! -f $1 ]] || (($(grep -c -- "$3" "$1") < $2)) || return 0
    sleep 0.1
  done
  echo "$1 has not $2 lines of $3"
  cat "$1" "$log"
  return 1
}

until_told() { has told "${2-1}" "$1"; }

@test "it serves on the sockets that it is passed, TCP and unix, and leaves --listen aside" {
  knock=127.0.0.1:$(free_port) second=127.0.0.1:$(free_port) aside=127.0.0.1:$(free_port)
  activate -l "$knock" -l "$second" -l "$PWD/passed" -- --listen "$aside"
  grep -qx "tweend [^ ]* listening on http://$knock, http://$second, unix:$PWD/passed" "$ready"
  grep -q -e '--listen is left aside' "$log"
  curl --silent --fail "http://$knock/readyz"
  curl --silent --fail "http://$second/readyz"
  curl --silent --fail --unix-socket passed http://localhost/readyz
  run curl --silent "http://$aside/readyz"
  [ "$status" = 7 ]
  url="" stop_daemon
  [ -S passed ] # it is not the daemon's to remove
}

@test "a socket called admin has probes and metrics without a key, in place of --admin-listen" {
  knock=127.0.0.1:$(free_port) admin=127.0.0.1:$(free_port) aside=127.0.0.1:$(free_port)
  activate -l "$knock" -l "$admin" --fdname=http:admin -- --api-keys secret --admin-listen "$aside"
  curl --silent --fail "http://$admin/metrics" --output answer
  run curl --silent --fail "http://$admin/v1/models"
  [ "$status" = 22 ]
  run curl --silent --fail "http://$knock/metrics"
  [ "$status" = 22 ]
  run curl --silent "http://$aside/readyz"
  [ "$status" = 7 ]
}

@test "sockets for another process are left aside" {
  LISTEN_FDS=1 LISTEN_PID=1 start_daemon
  get /readyz
  expect 200
}

@test "what cannot be served on is refused with a line" {
  knock=127.0.0.1:$(free_port)
  run timeout 20 systemd-socket-activate --datagram -l "$PWD/datagrams" "$program" --data "$PWD/data" < <(
    for _ in {1..100}; do [[ ! -S datagrams ]] || break; sleep 0.1; done
    python3 -c 'import socket; socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM).sendto(b"x", "datagrams")'
  )
  [ "$status" -eq 1 ]
  [[ $output == *"LISTEN_FDS: descriptor 3 is not a listening stream socket"* ]]
  NOTIFY_SOCKET=nowhere run timeout 10 "$program" --data "$PWD/data" --listen 127.0.0.1:0
  [ "$status" -eq 1 ]
  [[ $output == *"NOTIFY_SOCKET: 'nowhere'"* ]]
  WATCHDOG_USEC=often run timeout 10 "$program" --data "$PWD/data" --listen 127.0.0.1:0
  [ "$status" -eq 1 ]
  [[ $output == *"WATCHDOG_USEC: 'often'"* ]]
}

@test "it tells when it is ready, reads its settings again, and stops" {
  hear "$PWD/notify"
  NOTIFY_SOCKET=$PWD/notify start_daemon
  until_told '^READY=1$'
  grep -qx "STATUS=listening on $url" told
  kill -HUP "$daemon"
  until_told '^RELOADING=1$'
  until_told '^MONOTONIC_USEC=[0-9]\{4,\}$'
  until_told '^READY=1$' 2
  run ! grep -e STOPPING -e WATCHDOG told
  stop_daemon
  until_told '^STOPPING=1$'
}

@test "an abstract address is told as well, and the watchdog four times in its patience" {
  hear "@tweend-test-$$-$BATS_TEST_NUMBER"
  NOTIFY_SOCKET=@tweend-test-$$-$BATS_TEST_NUMBER WATCHDOG_USEC=2000000 start_daemon
  until_told '^READY=1$'
  sleep 2.2
  times=$(grep -c '^WATCHDOG=1$' told)
  ((times >= 3 && times <= 5)) || { echo "$times times"; false; }
}

@test "who comes during the drain is served by the next process on the same socket" {
  cat >pass_on.py <<'END'
# Listens, and runs the command twice on that socket, the second time when the first has ended.
import os, socket, sys
s = socket.create_server(('127.0.0.1', int(sys.argv[1])))
os.dup2(s.fileno(), 3)
os.set_inheritable(3, True)
for run in (1, 2):
    child = os.fork()
    if child == 0:
        os.environ.update(LISTEN_FDS='1', LISTEN_PID=str(os.getpid()))
        os.execv(sys.argv[2], sys.argv[2:])
    open('pids', 'a').write('%d\n' % child)
    if os.waitpid(child, 0)[1] != 0: sys.exit(1)
END
  port=$(free_port)
  log=$PWD/log
  timeout 60 python3 pass_on.py "$port" "$program" --data "$PWD/data" >ready 2>"$log" 3>&- &
  parent=$! url=http://127.0.0.1:$port
  has ready 1 listening
  upload "$samples/octopus.obj"
  curl --silent --max-time 20 --limit-rate 20M --output /dev/null "$url/v1/models/$id/surface.glb?level=6" 3>&- &
  slow=$!
  sleep 0.5
  kill -TERM "$(head -n 1 pids)"
  sleep 0.3
  kill -0 "$(head -n 1 pids)" # it drains
  get /v1/models
  expect 200 # and no 503
  [ "$(wc -l <pids)" = 2 ]
  wait "$slow"
  kill -TERM "$(tail -n 1 pids)"
  wait "$parent"
}

@test "systemd finds no fault with the units" {
  command -v systemd-analyze >/dev/null || skip "systemd-analyze is not installed"
  [ "$(grep -c '^ExecStart=tweend$' "$root/server/systemd/tweend.service")" = 1 ]
  sed "s|^ExecStart=tweend$|ExecStart=$program|" "$root/server/systemd/tweend.service" >tweend.service
  cp "$root/server/systemd/tweend.socket" .
  run systemd-analyze verify --man=no ./tweend.service ./tweend.socket
  [[ $status == 0 && -z $output ]]
  # Out of 100, where 100 is a service without any protection.
  systemd-analyze security --offline=true --threshold=15 ./tweend.service >exposure || { cat exposure; false; }
}

@test "the service manager starts, reloads and stops the unit" {
  [[ -d /run/systemd/system && $EUID == 0 ]] || skip "this machine was not started by systemd, or the tests are not run by root"
  unit=tweend-test-$$
  port=$(free_port)
  sed "s|^ExecStart=tweend$|ExecStart=$program|; /EnvironmentFile/d" "$root/server/systemd/tweend.service" >"/run/systemd/system/$unit.service"
  printf '[Service]\nEnvironment=TWEEND_LISTEN=127.0.0.1:%s\nStateDirectory=\nStateDirectory=%s\nEnvironment=TWEEND_DATA=%%S/%s\nProtectHome=no\n' \
    "$port" "$unit" "$unit" | install -D /dev/stdin "/run/systemd/system/$unit.service.d/test.conf"
  systemctl daemon-reload
  systemctl start "$unit"
  curl --silent --fail "http://127.0.0.1:$port/readyz"
  systemctl reload "$unit"
  [ "$(systemctl is-active "$unit")" = active ]
  systemctl stop "$unit"
  [ "$(systemctl show --property Result --value "$unit")" = success ]
  rm -r "/run/systemd/system/$unit.service" "/run/systemd/system/$unit.service.d" "/var/lib/private/$unit"
  systemctl daemon-reload
}
