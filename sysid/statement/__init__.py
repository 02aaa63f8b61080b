"""What a diagnosis says, as others read it.

document.py  the JSON document
verdicts.py  the verdict on each joint, in the document
text.py      the verdict on each joint, in lines
tables.py    what it rests on, in tables
laws.py      a law of one's own to begin with, where no effect explains what is left
alike.py     what many joints have alike: torques read late, friction that changed in the same logs
sizes.py     what logs could have shown, as a table
faults.py    what `sysid check` found, in lines
changes.py   the JSON document of what changed on a new log
"""
