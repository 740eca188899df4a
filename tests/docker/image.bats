# What the image is: small, without tools, not root, with a health check of its own.

image=${TWEEND_IMAGE:-tweend:test}

# Each test has one container at most, and a volume of its own if it outlives the container.
setup() { name=tweend-$BATS_TEST_NUMBER-$$; }
teardown() {
  docker rm --force --volumes "$name" >/dev/null 2>&1 || true
  docker volume rm "$name" >/dev/null 2>&1 || true
}

# started [OPTION...]: runs the image with a volume and a free port, and waits until it is ready.
started() {
  docker run --detach --name "$name" --read-only --cap-drop ALL --security-opt no-new-privileges --volume "${volume-/data}" \
    --publish 127.0.0.1::8080 "$@" "$image" >/dev/null
  url=http://$(docker port "$name" 8080/tcp | head -n 1)
  for _ in $(seq 200); do
    curl --silent --fail --output /dev/null "$url/readyz" && return
    sleep 0.05
  done
  return 1
}

@test "it runs as a user that is not root" {
  user=$(docker image inspect --format '{{.Config.User}}' "$image")
  [[ -n $user && $user != root && $user != 0 && $user != 0:* ]]
}

@test "it holds the program and its libraries, and no shell, compiler, header or package manager" {
  docker create --name "$name" "$image" >/dev/null
  docker export "$name" | tar t >"$BATS_TEST_TMPDIR/files"
  grep -qx 'usr/bin/tweend' "$BATS_TEST_TMPDIR/files"
  run grep -E '(^|/)(sh|bash|cc|gcc|g\+\+|cmake|apt|dpkg)$|\.h$' "$BATS_TEST_TMPDIR/files"
  echo "$output"
  [ "$status" -eq 1 ]
}

@test "every library that the program asks for is there" {
  run docker run --rm --read-only --cap-drop ALL "$image" --version
  [ "$status" -eq 0 ]
  [[ $output =~ [0-9]+\.[0-9]+\.[0-9]+ ]]
}

@test "its health check is the program's own, and says healthy" {
  [[ $(docker image inspect --format '{{json .Config.Healthcheck.Test}}' "$image") == *--healthcheck* ]]
  docker run --detach --name "$name" --read-only --cap-drop ALL --volume /data "$image" >/dev/null
  health=starting
  for _ in $(seq 60); do
    health=$(docker inspect --format '{{.State.Health.Status}}' "$name")
    [[ $health != starting ]] && break
    sleep 1
  done
  [ "$health" = healthy ]
}

@test "docker stop drains: it ends with status 0" {
  started
  docker stop --time 10 "$name" >/dev/null
  [ "$(docker inspect --format '{{.State.ExitCode}}' "$name")" = 0 ]
}

@test "it is under 40 MB" {
  size=$(docker image inspect --format '{{.Size}}' "$image")
  echo "# $((size / 1000 / 1000)) MB" >&3
  ((size < 40 * 1000 * 1000))
}

@test "its labels tell title, description, licences, when it was made, and the version that the program is" {
  label() { docker image inspect --format "{{index .Config.Labels \"org.opencontainers.image.$1\"}}" "$image"; }
  [ "$(label title)" = tweend ]
  [[ -n $(label description) ]]
  [[ $(label licenses) == "MIT AND LGPL-2.1-or-later AND "* ]]
  [[ $(label created) =~ ^20[0-9]{2}-[0-9]{2}-[0-9]{2}T[0-9:]+Z$ ]]
  [ "tweend $(label version)" = "$(docker run --rm --read-only --cap-drop ALL "$image" --version)" ]
}

# files: the image's root in a folder.
files() {
  mkdir "$BATS_TEST_TMPDIR/root"
  docker create --name "$name" "$image" >/dev/null
  docker export "$name" | tar x --directory "$BATS_TEST_TMPDIR/root" --exclude 'dev/*'
  cd "$BATS_TEST_TMPDIR/root" || return
}

@test "every library belongs to a package whose record and licences are there" {
  files
  # dpkg itself reads the records.
  mkdir "$BATS_TEST_TMPDIR/dpkg"
  touch "$BATS_TEST_TMPDIR/dpkg/available"
  for record in var/lib/dpkg/status.d/*; do cat "$record" && echo; done >"$BATS_TEST_TMPDIR/dpkg/status"
  dpkg-query --admindir="$BATS_TEST_TMPDIR/dpkg" --show --showformat '${Package} ${Version} ${db:Status-Status}\n' >packages
  cat packages
  [ "$(grep -c ' installed$' packages)" = "$(find var/lib/dpkg/status.d -type f | wc -l)" ]
  for package in libmicrohttpd12 libgnutls30 libc6 libstdc++6 libgcc-s1 ca-certificates base-files; do
    grep -q "^$package\\(t64\\)\\? [0-9]" packages
  done
  while read -r package _; do [ -s "usr/share/doc/$package/copyright" ]; done <packages
  grep -q 'LGPL' usr/share/doc/libmicrohttpd12*/copyright
  [ -s usr/share/common-licenses/LGPL-2.1 ]
  [ -s usr/share/doc/tweend/copyright ]
  grep -q '^ID=debian' etc/os-release
}

@test "it trusts the usual certificates" {
  files
  [ "$(grep -c 'BEGIN CERTIFICATE' etc/ssl/certs/ca-certificates.crt)" -gt 100 ]
}

# What the engine does before it starts the process is not counted; the best of three on a machine that does more.
@test "it is ready a second after it was started" {
  best=1000000
  for _ in 1 2 3; do
    started
    ready=$(date +%s%N)
    took=$(((ready - $(date --date "$(docker inspect --format '{{.State.StartedAt}}' "$name")" +%s%N)) / 1000000))
    ((took >= best)) || best=$took
    docker rm --force --volumes "$name" >/dev/null
  done
  echo "# $best ms" >&3
  ((best < 1000))
}

@test "the page is in it" {
  started
  run curl --silent "$url/"
  [[ $output == *'<script type="module">'* ]]
}

# 1.3 million points, 80 MB.
scan() {
  awk 'BEGIN { for (y = 0; y < 1140; y++) for (x = 0; x < 1140; x++) printf "v %d.25000 %d.50000 %.6f\n", x, y, (x * y % 97) / 97
    for (y = 0; y < 1139; y++) for (x = 1; x < 1140; x++) { a = y * 1140 + x; printf "f %d %d %d %d\n", a, a + 1, a + 1141, a + 1140 } }'
}

@test "with 512 MB of memory an OBJ of 80 MB is stored, and four at once are stored or refused for a while" {
  scan >"$BATS_TEST_TMPDIR/0.obj"
  bytes=$(stat -c %s "$BATS_TEST_TMPDIR/0.obj")
  echo "# $((bytes / 1000 / 1000)) MB" >&3
  for i in 1 2 3 4; do { cat "$BATS_TEST_TMPDIR/0.obj" && echo "# $i"; } >"$BATS_TEST_TMPDIR/$i.obj"; done
  started --memory 512m
  send() {
    curl --silent --dump-header "$BATS_TEST_TMPDIR/$1.head" --output /dev/null --write-out '%{http_code}' --header 'Expect:' \
      --header 'Content-Type: model/obj' --data-binary "@$BATS_TEST_TMPDIR/$1.obj" "$url/v1/models" >"$BATS_TEST_TMPDIR/$1.status"
  }
  send 0
  [ "$(cat "$BATS_TEST_TMPDIR/0.status")" = 201 ]
  clients=()
  for i in 1 2 3 4; do
    send "$i" 3>&- &
    clients+=($!)
  done
  wait "${clients[@]}"
  stored=0
  for i in 1 2 3 4; do
    status=$(cat "$BATS_TEST_TMPDIR/$i.status")
    echo "$i: $status"
    if [[ $status == 201 ]]; then
      stored=$((stored + 1))
    else
      [ "$status" = 503 ]
      grep -qi '^retry-after:' "$BATS_TEST_TMPDIR/$i.head"
    fi
  done
  echo "# $stored of four at once stored" >&3
  [ "$(docker inspect --format '{{.State.Running}} {{.State.OOMKilled}}' "$name")" = "true false" ]
  ((stored >= 1))
}

@test "with 1,024 idle connections it says that it is healthy" {
  ulimit -n 4096
  started
  address=$(docker inspect --format '{{range .NetworkSettings.Networks}}{{.IPAddress}}{{end}}' "$name")
  # shellcheck disable=SC2034 # a descriptor each, open until the test ends
  for ((i = 0; i < 1024; i++)); do exec {connection}<>"/dev/tcp/$address/8080"; done
  run curl --silent --output /dev/null --write-out '%{http_code}' --max-time 5 "http://$address:8080/healthz"
  [ "$output" = 200 ]
}

# As OpenShift does: a user that nobody knows, of the group root, and another one after it.
@test "any user of one group goes on with the models of another" {
  volume=$name:/data
  send() { curl --silent --fail --data-binary "@$BATS_TEST_DIRNAME/../../server/samples/$1.obj" "$url/v1/models"; }
  started --user 1000620000:0
  cube=$(send cube | gojq -r .id)
  docker rm --force "$name" >/dev/null
  started --user 1000630000:0
  curl --silent --fail --output /dev/null "$url/v1/models/$cube/surface.glb"
  send octopus
  curl --silent --fail --request DELETE "$url/v1/models/$cube"
}

@test "with one processor there is one compute thread" {
  started --cpus 1
  run curl --silent "$url/metrics"
  grep -qx 'tweend_compute_threads 1' <<<"$output"
}

@test "compose keeps the models in its named volume over a restart" {
  export TWEEND_PORT="" # a free one
  compose() { ${TESTED_COMPOSE-docker-compose} --project-name "tweend-test-$$" --file "$BATS_TEST_DIRNAME/../../docker/compose.yaml" "$@"; }
  ready() {
    url=http://$(compose port tweend 8080)
    for _ in $(seq 50); do
      curl --silent --fail --output /dev/null "$url/readyz" && return
      sleep 0.2
    done
    return 1
  }
  compose up --detach --no-build
  ready
  location=$(curl --silent --dump-header - --output /dev/null \
    --data-binary "@$BATS_TEST_DIRNAME/../../server/samples/cube.obj" "$url/v1/models" | sed -n 's/^Location: *\(.*\)\r$/\1/Ip')
  compose down
  compose up --detach --no-build
  ready
  run curl --silent --fail --output /dev/null "$url$location"
  compose down --volumes
  [ "$status" -eq 0 ]
}
