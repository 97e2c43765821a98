#!/bin/sh
# SPDX-License-Identifier: MIT
# First program inside user-mode Linux: the file systems a command expects, the bus, then the agent.
# Started by the kernel of the guest, whose command line user_mode.py makes. Mounts /proc, /sys, /dev/pts, /dev/shm and
# /run/lock, makes links in /dev, sets the name of the host and the limits of socket buffers, loads the modules of CAN,
# and creates vcan0 and vcan1. Switches the guest off when the agent has ended.
# $0 lies in the folder of the bus, where `boot` sets PYTHON, AGENT, MODULES and HOST.
PATH=/usr/sbin:/usr/bin:/sbin:/bin
# shellcheck source=/dev/null
. "${0%/*}/boot"
mount -t proc proc /proc
mount -t sysfs sys /sys
mkdir -p /dev/pts /dev/shm
mount -t devpts dev /dev/pts
mount -t tmpfs shm /dev/shm
# Locks of the commands inside concern this bus, not the host's.
[ ! -d /run/lock ] || mount -t tmpfs lock /run/lock
ln -s /proc/self/fd /dev/fd
ln -s /proc/self/fd/0 /dev/stdin
ln -s /proc/self/fd/1 /dev/stdout
ln -s /proc/self/fd/2 /dev/stderr
echo "$HOST" >/proc/sys/kernel/hostname
# Socket buffers as large as root may have, so that an ordinary user's recording keeps every frame too.
for limit in rmem_max wmem_max; do
    echo 67108864 >/proc/sys/net/core/$limit
done
for module in net/can/can net/can/can-raw drivers/net/can/dev/can-dev drivers/net/can/vcan; do
    insmod "$MODULES/kernel/$module.ko"
done
ip link set lo up
for bus in vcan0 vcan1; do
    ip link add dev $bus type vcan && ip link set $bus up || echo "with-vcan: no $bus"
done
"$PYTHON" -I -S "$AGENT" /dev/ttyS0
echo "with-vcan: the agent has ended: $?"
sync
echo o >/proc/sysrq-trigger
sleep 5
