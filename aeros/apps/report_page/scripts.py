"""The script of the report page: it filters the decisions, and links times of the run to the film.

Without the script, the page shows everything and offers nothing that would not work.
"""

from __future__ import annotations

from typing import Final

FILTER: Final = """\
const form=document.getElementById("filter"),rows=[...document.querySelectorAll("#decisions tbody tr")];
function show(){const on=new Set([...form.querySelectorAll("input:checked")].map(one=>one.value));
const skill=form.elements.skill.value,words=form.elements.words.value.toLowerCase();let count=0;
for(const row of rows){row.hidden=!(on.has(row.dataset.verdict)&&(!skill||row.dataset.skill===skill)
&&row.textContent.toLowerCase().includes(words));count+=row.hidden?0:Number(row.dataset.count)}
document.getElementById("shown").textContent=count+" decisions shown"}
form.addEventListener("input",show);form.addEventListener("submit",event=>event.preventDefault());
form.hidden=false;show();
"""
"""Shows the decisions that the form selects."""

FILM: Final = """\
const film=document.getElementById("film"),cursor=document.getElementById("cursor");
const part=film.dataset,axis=cursor.dataset;
const start=Number(part.start),end=Number(part.end),speed=Number(part.speed);
function filmTime(time){return Math.max(0,Math.min((time-start)/speed+0.005,(end-start)/speed-0.02))}
function runTime(time){return Math.min(start+time*speed,end)}
function cursorX(time){const share=Math.max(0,Math.min(time/Number(axis.end),1));
return Number(axis.left)+Number(axis.width)*share}
function point(){const x=cursorX(runTime(film.currentTime)).toFixed(1);
cursor.setAttribute("transform","translate("+x+")");cursor.removeAttribute("display")}
function follow(){point();if(!film.paused&&!film.ended)requestAnimationFrame(follow)}
function seek(event){const item=event.target.closest("[data-time]");
if(!item||event.type==="keydown"&&event.key!=="Enter"&&event.key!==" ")return;
event.preventDefault();film.currentTime=filmTime(Number(item.dataset.time));
film.scrollIntoView({block:"nearest"})}
for(const item of document.querySelectorAll("[data-time]")){item.setAttribute("tabindex","0");
item.setAttribute("role","button");const drawing=item.closest("svg");
if(drawing)drawing.setAttribute("role","group");else item.title="show this in the film"}
document.addEventListener("click",seek);document.addEventListener("keydown",seek);
film.addEventListener("play",follow);film.addEventListener("seeking",point);
film.addEventListener("timeupdate",point);
"""
"""Shows the film at the time of an item that is clicked or entered, and moves the cursor of the timeline.

A film is set a little after the time asked for, as players round times: at a picture's very time they may
show the one before.  It is set no later than shortly before its end, where it would start over.
"""
