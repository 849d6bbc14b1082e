#!/bin/bash
# Shows how much of each store and pyramid is there, by what lies on the disk: Slurm's word that a job is done is not taken for it.
# Ends with 0 only if all of them are there.
case $0 in */*) cd -- "${0%/*}" ;; esac
. ./settings.sh
