@echo off
rem Double-click.
title racecraft
cd /d "%~dp0parts"
python\python.exe begin.py %*
if errorlevel 1 pause
