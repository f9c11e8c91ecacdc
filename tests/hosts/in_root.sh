#!/bin/sh
# in_root.sh ROOT COMMAND...: runs a command in a root that hosts.py made, with this checkout, the cache of hosts and /tmp at
# their own paths, in the folder that it is called in where the root has that. Mounts are seen by the command alone.
root=$1
shift
here=$(dirname -- "$(readlink -f -- "$0")")
export SUNDER_ROOT="$root" SUNDER_CHECKOUT="${here%/tests/hosts}" SUNDER_CACHE="$(dirname -- "$root")"
exec unshare --mount sh -ec '
  for folder in /proc /sys /dev /tmp "$SUNDER_CHECKOUT" "$SUNDER_CACHE"; do
    mkdir -p "$SUNDER_ROOT$folder"
    mount --rbind "$folder" "$SUNDER_ROOT$folder"
  done
  cd "$SUNDER_ROOT"
  folder=$OLDPWD
  [ -d "$SUNDER_ROOT$folder" ] || folder=/
  exec chroot "$SUNDER_ROOT" env -C "$folder" "$@"' sh "$@"
